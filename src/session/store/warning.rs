//! A doubt about a result.

use serde::{Deserialize, Serialize};
use std::fmt;

/// A doubt about a stage's result: what was found, with its figure, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Warning {
    /// What was found.
    pub what: String,
    /// What to do.
    pub remedy: String,
}

impl Warning {
    pub(in crate::session) fn new(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { what: what.into(), remedy: remedy.into() }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.what, self.remedy)
    }
}
