//! `session.json`: which stages have run, on which inputs, and what they measured. Times are in `timings.json`, so that
//! equal recipes give equal bytes.

use super::hash::ContentHash;
use super::warning::Warning;
use crate::session::error::SessionError;
use crate::session::stage::Stage;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// The version of the layout of `session.json` and of all artefacts.
pub(in crate::session) const SCHEMA: u32 = 2;

/// The measures of a stage by name; units are in the names.
pub type Measures = BTreeMap<String, f64>;

/// The name of a measure, and its unit, which is the name's suffix.
pub fn name_and_unit(measure: &str) -> (String, &'static str) {
    let units = [("_mm", " mm"), ("_percent", " %"), ("_cm2", " cm²"), ("_deg", "°")];
    let found = units.iter().find_map(|(suffix, unit)| Some((measure.strip_suffix(suffix)?, *unit)));
    let (name, unit) = found.unwrap_or((measure, ""));
    (name.replace('_', " "), unit)
}

/// A stage that has run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageRecord {
    /// Hash over everything that the result depends on.
    pub inputs: ContentHash,
    /// The version of the stage's code.
    #[serde(default)]
    pub code: u32,
    /// All inputs by name; comparing them with the current ones shows why a stage is out of date.
    #[serde(default, skip_serializing_if = "Value::is_null")]
    pub from: Value,
    /// The result's name among the artefacts.
    pub output: ContentHash,
    /// Its measures.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub measures: Measures,
    /// Assumptions and observations, one sentence each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<String>,
    /// What is in doubt about the result.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<Warning>,
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
    /// Version of the layout of this file and of the artefacts.
    pub schema: u32,
    /// The hash of this state's recipe, independent of the location of its files.
    pub recipe: ContentHash,
    /// The steps, in the order of the recipe.
    pub steps: Vec<StepRecord>,
}

impl State {
    pub(in crate::session) fn new(recipe: ContentHash) -> Self {
        Self { schema: SCHEMA, recipe, steps: Vec::new() }
    }

    pub(in crate::session) fn to_text(&self) -> Result<String, SessionError> {
        let text = serde_json::to_string_pretty(self).map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
        Ok(text + "\n")
    }

    pub(in crate::session) fn parse(text: &str, path: &Path) -> Result<Self, SessionError> {
        /// Only the version, so that a newer file is recognised before its keys are not.
        #[derive(Deserialize)]
        struct StateVersion {
            schema: u32,
        }
        if let Ok(StateVersion { schema }) = serde_json::from_str::<StateVersion>(text)
            && schema != SCHEMA
        {
            let line = text.lines().position(|l| l.contains("\"schema\"")).map(|at| at + 1);
            if schema < SCHEMA {
                return Err(SessionError::OlderSession { dir: path.parent().unwrap_or(path).to_path_buf() });
            }
            return Err(SessionError::NewerSession { path: path.to_path_buf(), line, found: schema, known: SCHEMA });
        }
        serde_json::from_str(text).map_err(|e| SessionError::BadFile {
            path: path.to_path_buf(),
            line: Some(e.line()),
            reason: e.to_string(),
            hint:
                "the file was edited or damaged; delete it, and `overcoat build` rebuilds everything from recipe.toml"
                    .into(),
        })
    }

    /// The record of a stage, if it has run.
    pub fn record(&self, step: &str, stage: Stage) -> Option<&StageRecord> {
        self.steps.iter().find(|s| s.name == step)?.stages.get(&stage)
    }

    pub(in crate::session) fn put(&mut self, step: &str, stage: Stage, record: StageRecord) {
        let at = match self.steps.iter().position(|s| s.name == step) {
            Some(at) => at,
            None => {
                self.steps.push(StepRecord { name: step.into(), stages: BTreeMap::new() });
                self.steps.len() - 1
            }
        };
        self.steps[at].stages.insert(stage, record);
    }

    /// Moves the records of a step to its new name.
    pub(in crate::session) fn rename(&mut self, old: &str, new: &str) {
        self.steps.iter_mut().filter(|s| s.name == old).for_each(|s| s.name = new.into());
    }

    /// Drops steps and animations that are not in the recipe, and sorts the others in its order.
    pub(in crate::session) fn follow(&mut self, names: &[String]) {
        self.steps.retain(|s| names.contains(&s.name));
        self.steps.sort_by_key(|s| names.iter().position(|n| *n == s.name));
    }
}
