//! One frame of a stream as its format gives it: points of the format, in the frame and unit of the file.

use super::error::{StreamError, beginning};
use crate::body::Side;
use crate::drive::landmark::{LANDMARKS, Landmark};
use crate::geometry::Point;

/// Units. Nobody is tracked a million kilometres away, and such numbers lose their millimetres.
const FARTHEST: f64 = 1e9;

/// What a point of a format contributes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// A landmark.
    Landmark(Landmark),
    /// The anterior superior iliac spine: the bony tip in front of the hip.
    FrontOfPelvis(Side),
    /// The posterior superior iliac spine: the dimple above the buttock.
    BackOfPelvis(Side),
}

/// How many targets there are.
pub const TARGETS: usize = LANDMARKS + 4;

impl Target {
    /// Its place among all targets, the landmarks first.
    pub fn index(self) -> usize {
        match self {
            Self::Landmark(landmark) => landmark.index(),
            Self::FrontOfPelvis(Side::Left) => LANDMARKS,
            Self::FrontOfPelvis(Side::Right) => LANDMARKS + 1,
            Self::BackOfPelvis(Side::Left) => LANDMARKS + 2,
            Self::BackOfPelvis(Side::Right) => LANDMARKS + 3,
        }
    }
}

/// What one point is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Use {
    /// What it contributes to.
    pub target: Target,
    /// Points of a higher rank are used only where no point of a lower rank exists.
    pub rank: u8,
}

/// One point of one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Which point of the format, as an index into its uses.
    pub point: usize,
    /// Where it is; `None` where it was lost.
    pub place: Option<Point>,
    /// How sure the tracker is, 0 to 1.
    pub confidence: f64,
}

/// One frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record {
    /// The line.
    pub line: usize,
    /// Seconds on the clock of the tracker; `None` where the frame has no time.
    pub time_secs: Option<f64>,
    /// The points that the frame names.
    pub samples: Vec<Sample>,
    /// Names that are not known.
    pub unknown: Vec<String>,
    /// How many points had a coordinate that is no finite number.
    pub not_finite: usize,
}

/// The place with these coordinates; `None` where one is not finite.
pub fn finite_place(coordinates: [f64; 3]) -> Option<Point> {
    coordinates.iter().all(|value| value.abs() <= FARTHEST).then(|| Point::from(coordinates))
}

/// The error about a line that holds something else than a frame.
pub fn not_a_frame(line: usize, expected: impl Into<String>, found: &str) -> StreamError {
    StreamError::NotAFrame { line, expected: expected.into(), found: beginning(found) }
}
