//! What a stage reports.

use super::reason::Reason;
use crate::check::{self, StageFindings, StepVerdict};
use crate::session::recipe::StepRecipe;
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

/// The verdict on a step of which all stages are up to date. `failed` names the last step before it that failed, if one did: the
/// figure lacks its garment.
pub(in crate::session) fn verdict_on(step: &StepRecipe, reports: &[StageReport], failed: Option<&str>) -> StepVerdict {
    let mut of_step: Vec<&StageReport> = reports.iter().filter(|report| report.step == step.name).collect();
    of_step.sort_by_key(|report| report.stage);
    let found = of_step.iter().map(|report| StageFindings {
        stage: report.stage.name(),
        measures: &report.measures,
        warnings: report.warnings.iter().map(Warning::to_string).collect(),
    });
    let nothing = Measures::new();
    let without = failed.map(|failed| StageFindings {
        stage: Stage::Figure.name(),
        measures: &nothing,
        warnings: vec![check::on_the_figure_before(failed)],
    });
    let found: Vec<_> = found.chain(without).collect();
    check::verdict_on(&step.name, step.garment_template().as_ref(), !step.tryon, &found)
}
