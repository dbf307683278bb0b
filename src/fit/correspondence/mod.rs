//! Correspondences between a scan and a body: the scan's surface, closest points in both directions, sidedness, agreement,
//! limbs that the scan shows, and downsampled copies.

mod agreement;
mod closest;
mod downsampled;
mod limbs;
mod placement;
mod sampling;
mod scan_surface;
mod side;

pub(crate) use agreement::{dominant_joint, mean_and_p95};
pub(crate) use closest::{mean_truncated, mesh_to_scan_from, scan_to_mesh, scan_to_mesh_from};
pub(crate) use downsampled::{Downsampled, DownsampledModel};
pub(crate) use limbs::{
    JointSubtree, of_legs, part, parts, parts_from, pose_like_other_side, unseen, unseen_parts, visible_at,
    visible_shares,
};
pub(crate) use placement::shift_onto;
pub(crate) use sampling::spread;
pub(crate) use scan_surface::{LastFaces, ScanHit, ScanSurface};
pub(crate) use side::{Sidedness, side_of};
