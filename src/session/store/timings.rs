//! `timings.json`: the duration of the last run of each stage. Separate from the state, which must not depend on time.

use super::durable::{read_file, write_lightly};
use crate::session::error::SessionError;
use crate::session::stage::Stage;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Seconds by step and stage.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Timings {
    secs: BTreeMap<String, BTreeMap<Stage, f64>>,
}

fn path_in(dir: &Path) -> PathBuf {
    dir.join("timings.json")
}

impl Timings {
    /// Reads the durations. A missing or unreadable file counts as empty; nothing depends on it.
    pub(in crate::session) fn read(dir: &Path) -> Self {
        read_file(&path_in(dir)).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok()).unwrap_or_default()
    }

    pub(in crate::session) fn write(&self, dir: &Path) -> Result<(), SessionError> {
        let text = serde_json::to_string_pretty(self).map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
        write_lightly(&path_in(dir), (text + "\n").as_bytes())
    }

    pub(in crate::session) fn rename(&mut self, old: &str, new: &str) {
        if let Some(secs) = self.secs.remove(old) {
            self.secs.insert(new.into(), secs);
        }
    }

    pub(in crate::session) fn note(&mut self, step: &str, stage: Stage, secs: f64) {
        self.secs.entry(step.into()).or_default().insert(stage, secs);
    }

    /// Seconds that a stage took in its last run, if any.
    pub fn secs(&self, step: &str, stage: Stage) -> Option<f64> {
        self.secs.get(step)?.get(&stage).copied()
    }
}
