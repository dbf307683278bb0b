//! The poses of a figure over time.

use crate::body::Pose;
use serde::{Deserialize, Serialize};

/// The frames of a clip, from the first to the one before the last number; as text `30..120`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct FrameRange {
    /// First frame, counted from 0.
    pub from: usize,
    /// The frame after the last.
    pub to: usize,
}

impl std::fmt::Display for FrameRange {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}..{}", self.from, self.to)
    }
}

impl std::str::FromStr for FrameRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let range = text.split_once("..").and_then(|(from, to)| Some((from.parse().ok()?, to.parse().ok()?)));
        match range {
            Some((from, to)) if from < to => Ok(Self { from, to }),
            _ => Err("give A..B, two frame numbers with A < B; B is not included".into()),
        }
    }
}

impl TryFrom<String> for FrameRange {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<FrameRange> for String {
    fn from(range: FrameRange) -> Self {
        range.to_string()
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_is_read_from_its_text() {
        let range: FrameRange = "30..120".parse().unwrap();
        assert_eq!((range, range.to_string()), (FrameRange { from: 30, to: 120 }, "30..120".into()));
        for wrong in ["", "30", "30..", "..30", "30..30", "40..30", "-1..3", "a..b", "1..2..3"] {
            assert!(wrong.parse::<FrameRange>().is_err(), "{wrong}");
        }
    }
}
