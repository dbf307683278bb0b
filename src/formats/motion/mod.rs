//! Motion files: joints and their transforms over time. BVH is read and written here; [`RawMotion`] is what every reader
//! of motion returns.

mod bvh_read;
#[cfg(test)]
mod bvh_tests;
mod bvh_write;
mod pose_lines;
mod raw_motion;
mod smpl_motion;

pub use bvh_read::read_bvh;
pub use bvh_write::write_bvh;
pub use pose_lines::{PoseLineWriter, read_pose_lines};
pub use raw_motion::{RawJoint, RawMotion, RawTransform};
pub use smpl_motion::SmplMotion;
