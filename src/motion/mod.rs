//! Clips: read, retargeted to a figure, resampled.

mod alias_tables;
mod aligned;
mod built_in;
mod clearance;
mod clip;
mod contacts;
mod ease;
mod error;
mod fingers;
mod floor;
mod follow;
mod ground;
mod leg;
mod limits;
mod live;
mod mirrored;
mod names;
mod params;
mod placement;
mod planting;
mod retarget;
mod rig_map;
mod smooth;
mod structure;
#[cfg(test)]
mod tests;
mod track;

pub use built_in::{BUILT_IN_CLIPS, built_in_clip, clips_of_prior};
pub use clip::Clip;
pub use error::MotionError;
pub use follow::{MotionReport, follow};
pub(crate) use ground::Ground;
pub(crate) use limits::Anatomy;
pub use live::LiveRetargeter;
pub use params::MotionParams;
pub use track::{FrameRange, PoseTrack};
