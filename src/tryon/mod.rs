//! Try-on: puts an external garment onto a figure (Shi 2020).

mod dress;
mod ease;
mod error;
mod limbs;
mod paper;
mod placing;
mod recognize;
mod rims;
mod surface;
mod tape_ring;
#[cfg(test)]
mod tests;
mod thin;
mod trim;
mod upright;

pub use dress::{Posed, Worn, at_rest, at_rest_by_paper, edge_length_p95, moved_into};
pub use ease::{BAND, Ease, EaseGirth};
pub use error::TryOnError;
pub use paper::{GarmentPart, Person, Secs, Steps, Stop, Switches, by_paper};
pub use trim::Trim;
pub use upright::UprightGarment;
