//! Runs what is out of date, and reports the status.

use crate::session::error::SessionError;
use crate::session::open::{Session, Writer, source};
use crate::session::recipe::check_stage;
use crate::session::results::{Judged, target};
use crate::session::stage::Stage;
use crate::session::stages::{Event, Forced, Reason, StageReport, Walk, pipeline, scan_of};
use serde::Serialize;
use std::collections::BTreeMap;

impl Writer {
    /// Runs every stage that is out of date, in order; each result is durable before the next begins.
    pub fn build(
        &mut self,
        forced: &Forced,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<Vec<StageReport>, SessionError> {
        if self.session.recipe.steps.is_empty() {
            return Err(SessionError::NoScans { dir: self.session.dir().to_path_buf() });
        }
        if let Forced::Named(named) = forced {
            for (step, stage) in named {
                let step = self.session.recipe.step(step)?;
                if let Some(stage) = stage {
                    check_stage(&step.name, step.is_body(), *stage)?;
                }
            }
        }
        source::keep_missing(&mut self.session)?;
        let mut walk = Walk::make(self, "build", forced, on_event);
        pipeline::steps(&mut walk, None)?;
        Ok(walk.into_reports())
    }
}

pub(in crate::session) fn not_built_is_fine(error: SessionError) -> Result<(), SessionError> {
    if matches!(error, SessionError::NotBuilt { .. }) { Ok(()) } else { Err(error) }
}

/// The status of a step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StepStatus {
    /// Its name.
    pub name: String,
    /// The garment kind; `None` for the body.
    pub template: Option<String>,
    /// The scan's path.
    pub scan: String,
    /// Number of applied mask files.
    pub masks: usize,
    /// The stages that are up to date, in order.
    pub standing: Vec<StageReport>,
    /// The stages that are out of date, in order.
    pub stale: Vec<Stage>,
    /// The known reasons; the remaining stages wait for these.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub why: BTreeMap<Stage, Vec<Reason>>,
    /// The measures with limits of the stages that are up to date, in order.
    pub judged: Vec<Judged>,
    /// Whether the scan's file changed or disappeared since it was added. The session has its own copy.
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
        let stale_stages = walk.stale().to_vec();
        let mut reports = walk.into_reports();
        reports.sort_by(|a, b| (a.stage, &a.step).cmp(&(b.stage, &b.step)));
        reports.dedup_by(|a, b| a.step == b.step && a.stage == b.stage);
        let status = self.recipe.steps.iter().map(|step| {
            let standing: Vec<StageReport> = reports.iter().filter(|r| r.step == step.name).cloned().collect();
            let stale = Stage::of_step(step.template.is_none())
                .iter()
                .filter(|s| !standing.iter().any(|r| r.stage == **s))
                .copied()
                .collect();
            StepStatus {
                judged: standing.iter().flat_map(|report| target::judge(step, report)).collect(),
                name: step.name.clone(),
                template: step.template.clone(),
                scan: step.scan.clone(),
                masks: step.masks.len(),
                standing,
                stale,
                why: stale_stages.iter().filter(|s| s.step == step.name).map(|s| (s.stage, s.why.clone())).collect(),
                scan_changed: !self.source_is_as_it_was(&step.source()),
            }
        });
        Ok(status.collect())
    }
}
