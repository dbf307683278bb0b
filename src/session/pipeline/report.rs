//! What a stage reports.

use super::reason::Reason;
use crate::session::stage::Stage;
use crate::session::store::{Measures, Warning};
use serde::Serialize;

/// Report about a stage after a walk.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageReport {
    /// Its step.
    pub step: String,
    /// The stage.
    pub stage: Stage,
    /// Whether it ran now; otherwise it was up to date.
    pub ran: bool,
    /// The reasons why it ran.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub why: Vec<Reason>,
    /// Duration of its last run, in seconds.
    pub secs: Option<f64>,
    /// Its measures.
    pub measures: Measures,
    /// Assumptions and observations, one sentence each.
    pub findings: Vec<String>,
    /// What is in doubt about the result.
    pub warnings: Vec<Warning>,
}
