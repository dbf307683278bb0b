//! The poses of a figure over time.

use crate::body::Pose;
use serde::{Deserialize, Serialize};

/// The frames of a clip, from the first to the one before the last number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameRange {
    /// First frame, counted from 0.
    pub from: usize,
    /// The frame after the last.
    pub to: usize,
}

/// The poses of a figure, evenly in time: first those that lead in from the bind pose, then those of the clip.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseTrack {
    /// Frames per second.
    pub fps: f64,
    /// How many poses lead in; the first of them is the bind pose.
    pub lead: usize,
    /// All poses.
    pub poses: Vec<Pose>,
}

impl PoseTrack {
    /// The poses of the clip alone.
    pub fn clip_poses(&self) -> &[Pose] {
        &self.poses[self.lead..]
    }

    /// The time of a frame since the bind pose, in seconds.
    pub fn secs(&self, frame: usize) -> f64 {
        frame as f64 / self.fps
    }
}
