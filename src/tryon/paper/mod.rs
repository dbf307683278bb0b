//! The garment-fitting method of Shi 2020, step by step, without a session: parts by the discrete Reeb graph, curve skeletons by
//! mean curvature flow, the skeletons along the person's bones, the mesh after its skeletons, and out of the body.
//!
//! Each file is a step and names its equations, and where the paper is wrong or incomplete what we do instead. The simulation of
//! §6.3 is `cloth`'s, the certified clearance from all layers `stack`'s; both come after these steps.
//!
//! ```text
//! garment ─ reeb ─ planes ─ fill ─ skeleton ─ orient ─ bend ─ carry ─ move_to ─ clear → garment on the person
//! ```

mod bend;
mod carry;
mod clear;
mod contraction;
mod fill;
mod move_to;
mod orient;
mod person;
mod planes;
mod push;
mod reeb;
#[cfg(test)]
mod shapes_for_tests;
mod skeleton;
mod steps;
#[cfg(test)]
mod tests;

pub use person::Person;
pub use reeb::GarmentPart;
pub use steps::{Secs, Steps, Stop, Switches, by_paper};
