//! The registry of the stages: one line per stage, in the order in which they run.
//!
//! Everything else about a stage is in its file in `stages/`. The enum [`Stage`], the sections of a step in `recipe.toml`,
//! the table of parameters and the pipeline are made from these lines.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Passes the registry to the macro `$callback`. A line holds the variant, the name of the stage's file and of the stage
/// itself, the type in that file that runs it, the section of a step in `recipe.toml` that sets its parameters (if any),
/// and for the steps that have the stage the types of those parameters.
macro_rules! for_each_stage {
    ($callback:ident) => {
        $callback! {
            /// File to cleaned scan.
            Scan scan::ScanStage [reading]
                body (crate::scan::ScanParams, crate::scan::FusionParams)
                garment (crate::scan::ScanParams, crate::scan::FusionParams);
            /// Body model to naked scan.
            Fit fit::FitStage [fit] body (crate::fit::NakedParams);
            /// The model's surface onto the naked scan.
            Register register::RegisterStage [register] body (crate::fit::RegisterParams);
            /// The figure dressed so far inside the scan.
            Pose pose::PoseStage [pose] garment (crate::fit::InsideParams);
            /// The scan's evidence of the new garment, before any mask.
            Evidence evidence::EvidenceStage [] garment ();
            /// Labels: the part of the scan that is the new garment.
            Segment segment::SegmentStage [segment] garment (crate::segment::RefineParams);
            /// The garment cut out of the scan as its own mesh, with smooth hems.
            Cut cut::CutStage [cut] garment (crate::cut::CutParams);
            /// The garment's skin weights and its shape in the bind pose.
            Rig rig::RigStage [rig] garment (crate::rig::RigParams);
            /// The garment pushed clear of the layers inside.
            Stack stack::StackStage [stack] garment (crate::stack::StackParams);
            /// The figure with the new layer and its physics weights.
            Figure figure::FigureStage [figure] body () garment (crate::rig::PhysicsParams);
            /// The inner garments, pressed by the new one in this step's scan.
            Press press::PressStage [press] garment (crate::stack::PressParams);
            /// Whether the results of the step are plausible.
            Check check::CheckStage [] body () garment ();
            /// A clip on the figure of the last step; it belongs to no step.
            Animate animate::AnimateStage [];
            /// The cloth of an animation; it belongs to no step.
            Cloth cloth::ClothStage [];
        }
    };
}
pub(in crate::session) use for_each_stage;

macro_rules! stages {
    ($($(#[$about:meta])* $stage:ident $name:ident::$marker:ident [$($section:ident)?]
        $(body $body:tt)? $(garment $garment:tt)?;)*) => {
        /// A stage of a step, in the order in which they run.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(rename_all = "lowercase")]
        pub enum Stage {
            $($(#[$about])* $stage,)*
        }

        impl Stage {
            /// All stages.
            pub const ALL: &[Self] = &[$(Self::$stage),*];
            /// The stages of the body's step.
            pub const OF_BODY: &[Self] = &[$($(stages!(@first (Self::$stage) $body),)?)*];
            /// The stages of a garment's step.
            pub const OF_GARMENT: &[Self] = &[$($(stages!(@first (Self::$stage) $garment),)?)*];

            /// The name on the screen, in the recipe and in files.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$stage => stringify!($name),)*
                }
            }

            /// The section of a step in `recipe.toml` that sets the stage's parameters; `None` without any.
            pub fn section(self) -> Option<&'static str> {
                match self {
                    $(Self::$stage => [$(Some(stringify!($section)),)? None][0],)*
                }
            }
        }
    };
    (@first ($first:expr) $second:tt) => { $first };
}
for_each_stage!(stages);

impl Stage {
    /// The stages of a step.
    pub fn of_step(is_body: bool) -> &'static [Self] {
        if is_body { Self::OF_BODY } else { Self::OF_GARMENT }
    }

    /// The stage of that name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|stage| stage.name() == name)
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Respects padding, so that names can form columns.
        f.pad(self.name())
    }
}
