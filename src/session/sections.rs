//! The sections of a step in a recipe that say something of a stage's parameters: `[step.stack]`.

use super::parameters::Settings;
use super::recipe::StepRecipe;
use super::state::Stage;

/// The stages that a recipe may set parameters of.
pub(super) const WITH_SETTINGS: [Stage; 10] = [
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
pub(super) fn section_of(stage: Stage) -> String {
    match stage {
        Stage::Scan => "reading".into(),
        other => other.to_string(),
    }
}

impl StepRecipe {
    /// What is said of a stage's parameters.
    pub fn settings(&self, stage: Stage) -> &Settings {
        static NONE: Settings = Settings::new();
        match stage {
            Stage::Scan => &self.reading,
            Stage::Fit => &self.fit,
            Stage::Register => &self.register,
            Stage::Pose => &self.pose,
            Stage::Segment => &self.segment,
            Stage::Cut => &self.cut,
            Stage::Rig => &self.rig,
            Stage::Stack => &self.stack,
            Stage::Figure => &self.figure,
            Stage::Press => &self.press,
            Stage::Evidence => &NONE,
        }
    }

    /// The same, to be changed; `None` for a stage without parameters.
    pub(super) fn settings_mut(&mut self, stage: Stage) -> Option<&mut Settings> {
        match stage {
            Stage::Scan => Some(&mut self.reading),
            Stage::Fit => Some(&mut self.fit),
            Stage::Register => Some(&mut self.register),
            Stage::Pose => Some(&mut self.pose),
            Stage::Segment => Some(&mut self.segment),
            Stage::Cut => Some(&mut self.cut),
            Stage::Rig => Some(&mut self.rig),
            Stage::Stack => Some(&mut self.stack),
            Stage::Figure => Some(&mut self.figure),
            Stage::Press => Some(&mut self.press),
            Stage::Evidence => None,
        }
    }
}
