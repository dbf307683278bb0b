//! The names of the stages, in the order in which they run.

use serde::{Deserialize, Serialize};
use std::fmt;

/// A stage of a step or of an animation.
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
    /// The scan's evidence of the new garment, before any mask.
    Evidence,
    /// Labels: the part of the scan that is the new garment.
    Segment,
    /// The garment cut out of the scan as its own mesh, with smooth hems.
    Cut,
    /// The garment's skin weights and its shape in the bind pose.
    Rig,
    /// The garment pushed clear of the layers inside.
    Stack,
    /// The figure with the new layer and its physics weights.
    Figure,
    /// The inner garments, pressed by the new one in this step's scan.
    Press,
    /// Buttons and other parts of a garment's file, bound to its cloth.
    Trim,
    /// Whether the results of the step are plausible.
    Check,
    /// A clip on the figure of the last step; it belongs to no step.
    Animate,
    /// The cloth of an animation; it belongs to no step.
    Cloth,
}

/// Each stage with its name, and the section of a step in `recipe.toml` that sets its parameters.
const NAMES: [(Stage, &str, Option<&str>); 15] = [
    (Stage::Scan, "scan", Some("reading")),
    (Stage::Fit, "fit", Some("fit")),
    (Stage::Register, "register", Some("register")),
    (Stage::Pose, "pose", Some("pose")),
    (Stage::Evidence, "evidence", None),
    (Stage::Segment, "segment", Some("segment")),
    (Stage::Cut, "cut", Some("cut")),
    (Stage::Rig, "rig", Some("rig")),
    (Stage::Stack, "stack", Some("stack")),
    (Stage::Figure, "figure", Some("figure")),
    (Stage::Press, "press", Some("press")),
    (Stage::Trim, "trim", None),
    (Stage::Check, "check", None),
    (Stage::Animate, "animate", None),
    (Stage::Cloth, "cloth", None),
];

impl Stage {
    /// All stages.
    pub fn all() -> impl DoubleEndedIterator<Item = Self> {
        NAMES.iter().map(|(stage, ..)| *stage)
    }

    /// The name on the screen, in the recipe and in files.
    pub fn name(self) -> &'static str {
        NAMES[self as usize].1
    }

    /// The section of a step in `recipe.toml` that sets the stage's parameters; `None` without any.
    pub fn section(self) -> Option<&'static str> {
        NAMES[self as usize].2
    }

    /// The stage of that name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::all().find(|stage| stage.name() == name)
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Respects padding, so that names can form columns.
        f.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stage_has_its_own_name_in_the_table_and_in_files() {
        for (at, stage) in Stage::all().enumerate() {
            assert_eq!(stage as usize, at, "{stage} is at another place in the table");
            assert_eq!(serde_json::json!(stage), stage.name());
            assert_eq!(Stage::parse(stage.name()), Some(stage));
        }
        assert_eq!(Stage::all().last(), Some(Stage::Cloth), "the table ends early");
    }
}
