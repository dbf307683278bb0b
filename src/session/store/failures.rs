//! `failures.json`: the stages that failed when they last ran. Apart from the state, of which undo and replay keep copies.

use super::durable::write_lightly;
use super::hash::ContentHash;
use crate::session::error::SessionError;
use crate::session::stage::Stage;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Why a stage has no result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// The stage.
    pub stage: Stage,
    /// Hash over everything that it depended on: with other inputs it may succeed.
    pub(in crate::session) inputs: ContentHash,
    /// What went wrong.
    pub what: String,
    /// What to do, where that is known.
    pub remedy: Option<String>,
}

/// The failures by step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub(in crate::session) struct Failures(BTreeMap<String, Failure>);

fn path_in(dir: &Path) -> PathBuf {
    dir.join("failures.json")
}

impl Failures {
    /// The failures that were noted. Nothing depends on a file that is missing or unreadable: the stage only has to run again.
    pub fn read(dir: &Path) -> Self {
        std::fs::read(path_in(dir)).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok()).unwrap_or_default()
    }

    pub fn write(&self, dir: &Path) -> Result<(), SessionError> {
        let text = serde_json::to_string_pretty(self).map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
        write_lightly(&path_in(dir), (text + "\n").as_bytes())
    }

    /// Notes a failure; a step has at most one, because the stages of the step after it wait.
    pub fn note(&mut self, step: &str, failure: Failure) {
        self.0.insert(step.into(), failure);
    }

    /// Forgets the failure of a stage that has run. Returns whether there was one.
    pub fn forget(&mut self, step: &str, stage: Stage) -> bool {
        let noted = self.0.get(step).is_some_and(|failure| failure.stage == stage);
        noted && self.0.remove(step).is_some()
    }

    /// Whether a failure of a step is noted.
    pub fn has(&self, step: &str) -> bool {
        self.0.contains_key(step)
    }

    /// The failure of a stage with these inputs.
    pub fn of(&self, step: &str, stage: Stage, inputs: ContentHash) -> Option<&Failure> {
        self.0.get(step).filter(|failure| failure.stage == stage && failure.inputs == inputs)
    }
}
