//! Try-on: puts an external garment onto a figure (Shi 2020).

mod dress;
mod error;
mod limbs;
mod placing;
mod recognize;
mod rims;
mod surface;
#[cfg(test)]
mod tests;
mod thin;
mod upright;

pub use dress::{Worn, at_rest, edge_length_p95};
pub use error::TryOnError;
pub use placing::{Placed, place};
pub use upright::UprightGarment;
