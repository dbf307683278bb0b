//! Try-on: puts an external garment onto a figure (Shi 2020).

mod dress;
mod error;
mod limbs;
mod paper;
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
pub use paper::{
    Bent, BentSkeleton, BoundaryPlane, Cleared, ClosedPart, CoarseParts, CurveSkeleton, GarmentPart, KAPPA, Moved,
    Oriented, PartSkeletons, Person, ReebNode, RefinedParts, Secs, Steps, Stop, Switches, bent_limb, bent_torso,
    by_paper, cleared, closed_part, coarse_parts, curve_skeleton, moved_to, oriented, refined_parts,
};
pub use placing::{Placed, place};
pub use recognize::Openings;
pub use rims::Rim;
pub use upright::UprightGarment;
