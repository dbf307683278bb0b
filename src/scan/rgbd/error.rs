//! Why frames cannot be fused.

use crate::formats::FormatError;

/// Why RGB-D frames cannot be fused. Frames are named by their depth image.
#[derive(Debug, thiserror::Error)]
pub enum FusionError {
    /// Too few to make a surface all around.
    #[error("there are only {count} frames; a turn of a person needs at least {least}")]
    TooFewFrames {
        /// How many.
        count: usize,
        /// Number needed.
        least: usize,
    },
    /// An image of a frame cannot be read.
    #[error("frame {name}: {source}")]
    Image {
        /// The image.
        name: String,
        /// What is wrong with it.
        source: FormatError,
    },
    /// A depth image of another size than the camera's.
    #[error("frame {name} has {width} × {height} pixels, but camera.json says {expected_width} × {expected_height}")]
    WrongSize {
        /// The frame.
        name: String,
        /// Its width in pixels.
        width: usize,
        /// Its height in pixels.
        height: usize,
        /// The camera's width in pixels.
        expected_width: usize,
        /// The camera's height in pixels.
        expected_height: usize,
    },
    /// Frames without any depth.
    #[error("frame {name} holds no depth at all: every pixel is 0 ({count} of {of} frames looked at are so)")]
    NoDepth {
        /// The first.
        name: String,
        /// How many of the sampled frames have no depth.
        count: usize,
        /// How many frames were sampled.
        of: usize,
    },
    /// Depths outside the range of a person.
    #[error(
        "in frame {name} everything is {nearest:.2} to {farthest:.2} m away: a person stands 0.3 to 8 m from the camera"
    )]
    WrongScale {
        /// The frame.
        name: String,
        /// Metres.
        nearest: f64,
        /// Metres.
        farthest: f64,
        /// The scale that would put a person in view, in units per metre.
        likely: Option<f64>,
    },
    /// Nothing of a person's size in front of the background.
    #[error("nobody is in view: nothing of a person's size is in front of the background in frame {name}")]
    NobodyInView {
        /// The frame.
        name: String,
        /// The scale that would put a person in view, in units per metre.
        likely: Option<f64>,
    },
    /// The background moves.
    #[error("the camera moved: the background is not where it was in frame {first} from frame {name} on")]
    CameraMoved {
        /// The frame of reference.
        first: String,
        /// The first frame that differs.
        name: String,
    },
    /// Nothing turns.
    #[error("the person does not turn: over {count} frames they turned by {turned_deg:.0}° in all")]
    NoTurn {
        /// How many frames.
        count: usize,
        /// Degrees.
        turned_deg: f64,
    },
    /// Tracking was lost for good.
    #[error("frame {name} does not overlap with the frames before it; {lost} of {count} frames found no place")]
    NoOverlap {
        /// The first frame that was lost.
        name: String,
        /// How many were.
        lost: usize,
        /// Of how many.
        count: usize,
    },
    /// The volume holds no surface.
    #[error("the {count} frames hold no surface that was seen often enough")]
    NoSurface {
        /// How many frames.
        count: usize,
    },
}

impl FusionError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        let hint = match self {
            Self::TooFewFrames { .. } => "record a whole turn, with a frame at least every 15°",
            Self::Image { source, .. } => return source.hint(),
            Self::WrongSize { .. } => {
                "give the width and height of the depth images, and the camera's other values at that size"
            }
            Self::NoDepth { .. } => "was the camera covered, or colour stored in place of depth? Leave such frames out",
            Self::WrongScale { likely: Some(scale), .. } | Self::NobodyInView { likely: Some(scale), .. } => {
                return Some(format!(
                    "depth_scale {scale:.0}? With it, most of what the frames show is at a person's distance"
                ));
            }
            Self::WrongScale { .. } => {
                "check depth_scale in camera.json: units a metre, 1000 where depths are millimetres"
            }
            Self::NobodyInView { .. } => {
                "the person stands alone on the turntable, from head to feet in the image, 1 to 3 m from the camera; depth_max in camera.json cuts off what lies behind"
            }
            Self::CameraMoved { .. } => {
                "keep the camera still and turn the person; if the camera went around, cut the background out of the depth images (set it to 0)"
            }
            Self::NoTurn { .. } => "the person, on a turntable, turns before a still camera; give those frames",
            Self::NoOverlap { .. } => {
                "record more slowly, a frame at least every 15°, and keep other things out of the way"
            }
            Self::NoSurface { .. } => "check that the frames show one person who holds still",
        };
        Some(hint.into())
    }
}
