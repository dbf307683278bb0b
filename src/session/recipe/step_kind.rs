//! The kinds of steps: which stages and which parameters a step has.

use crate::session::stage::Stage;
use serde::Serialize;

/// The kind of a step, which decides its stages and its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StepKind {
    /// The bare body.
    Body,
    /// A garment, alone in its scan or with the others of an outfit.
    Garment,
    /// The hair of the bare scan.
    Hair,
}

impl StepKind {
    /// The stages of such a step; a test compares them with a build.
    pub fn stages(self) -> &'static [Stage] {
        use Stage::{Check, Cut, Evidence, Figure, Fit, Pose, Press, Register, Rig, Scan, Segment, Stack};
        match self {
            Self::Body => &[Scan, Fit, Register, Figure, Check],
            Self::Garment | Self::Hair => &[Scan, Pose, Evidence, Segment, Cut, Rig, Stack, Figure, Press, Check],
        }
    }
}
