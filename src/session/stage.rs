//! The names of the stages, in the order in which they run.

use serde::{Deserialize, Serialize};
use std::fmt;

/// A stage of a step, in the order in which they run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stage {
    /// File to cleaned scan.
    Scan,
    /// Body model to naked scan.
    Fit,
    /// The model's surface onto the naked scan.
    Register,
    /// The figure dressed so far inside the scan.
    Pose,
    /// What the scan shows of the new garment, before any mask.
    Evidence,
    /// Which of the scan is the new garment.
    Segment,
    /// The garment as a mesh of its own, with its hems.
    Cut,
    /// Its skin weights and its shape in the bind pose.
    Rig,
    /// Pushed clear of what lies inside.
    Stack,
    /// Weighed for physics and put on the figure.
    Figure,
    /// What is worn below, pressed as it was in this step's scan.
    Press,
}

impl Stage {
    /// The stages of the body's step.
    pub const OF_BODY: [Self; 4] = [Self::Scan, Self::Fit, Self::Register, Self::Figure];
    /// The stages of a garment's step.
    pub const OF_GARMENT: [Self; 9] = [
        Self::Scan,
        Self::Pose,
        Self::Evidence,
        Self::Segment,
        Self::Cut,
        Self::Rig,
        Self::Stack,
        Self::Figure,
        Self::Press,
    ];

    /// The stages of a step.
    pub fn of_step(is_body: bool) -> &'static [Self] {
        if is_body { &Self::OF_BODY } else { &Self::OF_GARMENT }
    }

    /// Goes up whenever the stage's code gives another result for the same inputs.
    pub(in crate::session) fn code_version(self) -> u32 {
        match self {
            // Surfaces give way by a model's corrective offsets; a baked texture is kept as a PNG.
            Self::Register | Self::Figure => 3,
            // Rounds end where joints are still.
            Self::Fit => 6,
            // Garments are thinned out; steps that go to and fro are shortened.
            Self::Pose => 7,
            Self::Rig | Self::Press => 2,
            // A mask moves the boundary near it alone; the cut keeps what was painted.
            Self::Segment => 2,
            // A hole made by hand is no hem.
            Self::Cut => 3,
            // Rays and voxels of the fusion are reckoned otherwise, and again for speed; a person before nothing is cut out by it.
            Self::Scan => 3,
            _ => 1,
        }
    }

    /// The stage of that name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::OF_BODY.into_iter().chain(Self::OF_GARMENT).find(|s| s.to_string() == name)
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Scan => "scan",
            Self::Fit => "fit",
            Self::Register => "register",
            Self::Pose => "pose",
            Self::Evidence => "evidence",
            Self::Segment => "segment",
            Self::Cut => "cut",
            Self::Rig => "rig",
            Self::Stack => "stack",
            Self::Figure => "figure",
            Self::Press => "press",
        })
    }
}
