//! `session.json`: which stages stand, on what inputs, and what they measured. Times are in `timings.json`, so that the
//! same recipe gives the same bytes.

use super::{ContentHash, SessionError};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

/// The version of the layout of `session.json` and of all artefacts.
pub(super) const SCHEMA: u32 = 1;

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
    pub(super) fn code_version(self) -> u32 {
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

/// What a stage measured, by name; units are in the names.
pub type Measures = BTreeMap<String, f64>;

/// A stage that has run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageRecord {
    /// Hash over everything that the result depends on.
    pub inputs: ContentHash,
    /// The version of the stage's code.
    #[serde(default)]
    pub code: u32,
    /// All of those inputs by name: what those of a stage that is stale are compared with, to say why it is.
    #[serde(default, skip_serializing_if = "Value::is_null")]
    pub from: Value,
    /// The result's name among the artefacts.
    pub output: ContentHash,
    /// What it measured.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub measures: Measures,
    /// What it assumed or noticed, for people.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<String>,
}

/// The stages of one step that have run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// The step's name.
    pub name: String,
    /// By stage.
    #[serde(default)]
    pub stages: BTreeMap<Stage, StageRecord>,
}

/// The content of `session.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Layout of this file and of the artefacts.
    pub schema: u32,
    /// What the recipe asks for that this is the state of, wherever its files lie.
    pub recipe: ContentHash,
    /// In the order of the recipe.
    pub steps: Vec<StepRecord>,
}

impl State {
    pub(super) fn new(recipe: ContentHash) -> Self {
        Self { schema: SCHEMA, recipe, steps: Vec::new() }
    }

    pub(super) fn to_text(&self) -> Result<String, SessionError> {
        let text = serde_json::to_string_pretty(self).map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
        Ok(text + "\n")
    }

    pub(super) fn parse(text: &str, path: &Path) -> Result<Self, SessionError> {
        /// Only the version, so that a newer file is recognised before its keys are not.
        #[derive(Deserialize)]
        struct Versioned {
            schema: u32,
        }
        if let Ok(Versioned { schema }) = serde_json::from_str::<Versioned>(text)
            && schema != SCHEMA
        {
            let line = text.lines().position(|l| l.contains("\"schema\"")).map(|at| at + 1);
            return Err(SessionError::NewerSession { path: path.to_path_buf(), line, found: schema, known: SCHEMA });
        }
        serde_json::from_str(text).map_err(|e| SessionError::BadFile {
            path: path.to_path_buf(),
            line: Some(e.line()),
            reason: e.to_string(),
            hint: "the file was edited or damaged; delete it, and `overcoat build` makes everything again from recipe.toml".into(),
        })
    }

    /// The record of a stage, if it has run.
    pub fn record(&self, step: &str, stage: Stage) -> Option<&StageRecord> {
        self.steps.iter().find(|s| s.name == step)?.stages.get(&stage)
    }

    pub(super) fn put(&mut self, step: &str, stage: Stage, record: StageRecord) {
        let at = match self.steps.iter().position(|s| s.name == step) {
            Some(at) => at,
            None => {
                self.steps.push(StepRecord { name: step.into(), stages: BTreeMap::new() });
                self.steps.len() - 1
            }
        };
        self.steps[at].stages.insert(stage, record);
    }

    /// Drops steps that the recipe no longer has, and puts the rest in its order.
    pub(super) fn follow(&mut self, names: &[&str]) {
        self.steps.retain(|s| names.contains(&s.name.as_str()));
        self.steps.sort_by_key(|s| names.iter().position(|n| *n == s.name));
    }
}
