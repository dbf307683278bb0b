//! Errors of motion.

use crate::body::Limb;

/// Why a clip cannot move a figure.
#[derive(Debug, thiserror::Error)]
pub enum MotionError {
    /// The clip's skeleton is not that of a person.
    #[error("the clip's {joints} joints do not form a person: {missing}")]
    NotAPerson {
        /// Joints of the clip.
        joints: usize,
        /// What was looked for and not found, as a clause.
        missing: String,
    },
    /// The bones of the legs have no length, so nothing can be scaled.
    #[error("the legs of the clip's skeleton are {found} units long in frame {frame}, so its size is unknown")]
    NoLegs {
        /// Their length.
        found: f64,
        /// The frame, counted from 0.
        frame: usize,
    },
    /// A number of the clip is so large that computation overflows.
    #[error("frame {frame} of the clip places a joint at no finite position")]
    NotFinite {
        /// The frame, counted from 0.
        frame: usize,
    },
    /// A range of frames that the clip does not have.
    #[error("the clip has {frames} frames at {fps} per second: it has no frames {from}..{to}")]
    NoSuchFrames {
        /// Number of frames.
        frames: usize,
        /// Frames per second.
        fps: f64,
        /// First frame of the range.
        from: usize,
        /// The frame after the last.
        to: usize,
    },
    /// The frame rate and the clip's length give too many frames.
    #[error("{frames} frames are too many: a track has at most {most}")]
    TooManyFrames {
        /// That would be made.
        frames: usize,
        /// The limit.
        most: usize,
    },
    /// A figure that cannot be moved by clips.
    #[error("the figure's skeleton has no {}", limb.name())]
    FigureWithout {
        /// The limb that it does not have.
        limb: Limb,
    },
}

impl MotionError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::NotAPerson { .. } => {
                "export the clip with a whole human skeleton; names as of Mixamo, CMU, SMPL, Unreal, VRM, MakeHuman, Rigify \
                 or Biped are known"
                    .into()
            }
            Self::NoLegs { .. } | Self::NotFinite { .. } => "export the clip again; its skeleton is damaged".into(),
            Self::NoSuchFrames { frames, .. } => {
                format!("give --frames A..B with A < B ≤ {frames}; frames are counted from 0, and B is not included")
            }
            Self::TooManyFrames { .. } => "give a lower --fps, or a range of --frames".into(),
            Self::FigureWithout { .. } => "use a body model with the joints of a whole person".into(),
        })
    }
}
