//! The sections of a step in a recipe that say something of a stage's parameters: `[step.stack]`.

use crate::session::stage::Stage;

/// The stages that a recipe may set parameters of.
pub(in crate::session) const WITH_SETTINGS: [Stage; 10] = [
    Stage::Scan,
    Stage::Fit,
    Stage::Register,
    Stage::Pose,
    Stage::Segment,
    Stage::Cut,
    Stage::Rig,
    Stage::Stack,
    Stage::Figure,
    Stage::Press,
];

/// Where a step says so: under the stage's name, but `scan` is the scan's file.
pub(in crate::session) fn section_of(stage: Stage) -> String {
    match stage {
        Stage::Scan => "reading".into(),
        other => other.to_string(),
    }
}
