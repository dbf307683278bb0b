//! What is up to date in a session, what is not, and the verdict on each step.

use crate::check::{Judged, StepVerdict, Verdict, judge};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::{self, Reason, StageReport, Walk, scan_of, verdict_on};
use crate::session::stage::Stage;
use serde::Serialize;
use std::collections::BTreeMap;

/// The status of a step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepStatus {
    /// Its name.
    pub name: String,
    /// The garment kind; `None` for the body.
    pub template: Option<String>,
    /// The scan's path.
    pub scan: String,
    /// How many mask files are applied.
    pub masks: usize,
    /// The stages that are up to date, in order.
    pub up_to_date: Vec<StageReport>,
    /// The stages that are out of date, in order.
    pub out_of_date: Vec<Stage>,
    /// The reasons, where they are known; the other stages wait for these.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub why: BTreeMap<Stage, Vec<Reason>>,
    /// The verdict; `None` while a stage is out of date that has not failed.
    pub verdict: Option<Verdict>,
    /// Every doubt, the gravest first: one sentence each.
    pub warnings: Vec<String>,
    /// What was done that the scan does not tell by itself and that is no doubt: one sentence each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// The measures with limits of the stages that are up to date, in order.
    pub judged: Vec<Judged>,
    /// The file was changed since it was scanned, or is gone. The session has its own copy.
    pub scan_changed: bool,
}

impl Session {
    /// The status of every step. Runs nothing.
    pub fn status(&self) -> Result<Vec<StepStatus>, SessionError> {
        let mut walk = Walk::look(self);
        let mut looked = pipeline::steps(&mut walk, None).map(drop);
        // A walk ends at the first stage that is out of date; the scans after it do not depend on it.
        for step in &self.recipe.steps {
            looked = looked.or_else(not_built_is_fine).and_then(|()| scan_of(&mut walk, step).map(drop));
        }
        looked.or_else(not_built_is_fine)?;
        let pending = walk.out_of_date().to_vec();
        let mut reports = walk.into_reports();
        reports.sort_by(|a, b| (a.stage, &a.step).cmp(&(b.stage, &b.step)));
        reports.dedup_by(|a, b| a.step == b.step && a.stage == b.stage);
        let mut failed: Option<&str> = None;
        let status = self.recipe.steps.iter().map(|step| {
            let up_to_date: Vec<StageReport> = reports.iter().filter(|r| r.step == step.name).cloned().collect();
            let out_of_date: Vec<Stage> =
                step.kind().stages().iter().filter(|s| !up_to_date.iter().any(|r| r.stage == **s)).copied().collect();
            let own = || pending.iter().filter(|s| s.step == step.name);
            let failure = own().find_map(|s| s.failure.as_ref());
            let judged = match (failure, out_of_date.is_empty()) {
                (Some(failure), _) => Some(StepVerdict::failed(&step.name, &failure.what, failure.remedy.as_deref())),
                (None, true) => Some(verdict_on(step, &up_to_date, failed)),
                (None, false) => None,
            };
            if failure.is_some() {
                failed = Some(&step.name);
            }
            let template = step.garment_template();
            let judge_one = |of: &StageReport| judge(template.as_ref(), of.stage.name(), &of.measures);
            let (verdict, warnings, notes) =
                judged.map_or((None, Vec::new(), Vec::new()), |j| (Some(j.verdict), j.warnings, j.notes));
            StepStatus {
                notes,
                verdict,
                warnings,
                judged: up_to_date.iter().flat_map(judge_one).collect(),
                name: step.name.clone(),
                template: step.template.clone(),
                scan: step.scan.clone(),
                masks: step.masks.len(),
                up_to_date,
                out_of_date,
                why: own().map(|s| (s.stage, s.why.clone())).collect(),
                scan_changed: !self.source_is_as_it_was(&step.source()),
            }
        });
        Ok(status.collect())
    }
}

impl StepStatus {
    /// The verdict with its doubts, if there is one.
    pub fn into_verdict(self) -> Option<StepVerdict> {
        let Self { name: step, verdict, warnings, notes, .. } = self;
        verdict.map(|verdict| StepVerdict { step, verdict, warnings, notes })
    }
}

pub(in crate::session) fn not_built_is_fine(error: SessionError) -> Result<(), SessionError> {
    if matches!(error, SessionError::NotBuilt { .. }) { Ok(()) } else { Err(error) }
}
