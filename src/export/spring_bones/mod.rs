//! Chains of joints along the loose parts of garments, which programs swing by springs: VRM's `VRMC_springBone`.
//!
//! A skirt's skin weights follow the legs. Here its loose part follows chains from the hips to the hem instead, and capsules
//! around the legs push the chains out of their way.

mod chains;
mod fit;
mod simulation;
#[cfg(test)]
mod tests;

pub(super) use chains::{SpringFigure, with_spring_bones};
pub use fit::{FittedSprings, fitted_springs};
pub use simulation::SpringParams;
