//! Runs what is out of date.

use crate::check::StepVerdict;
use crate::session::error::SessionError;
use crate::session::open::{Writer, source};
use crate::session::pipeline::{self, Event, Forced, StageReport, Walk, verdict_on};
use crate::session::recipe::check_stage;

impl Writer {
    /// Runs every stage that is out of date, in order; each result is durable before the next begins.
    pub fn build(&mut self, forced: &Forced, on_event: &mut dyn FnMut(&Event)) -> Result<Built, SessionError> {
        if self.session.recipe.steps.is_empty() {
            return Err(SessionError::NoScans { dir: self.session.dir().to_path_buf() });
        }
        if let Forced::Named(named) = forced {
            for (step, stage) in named {
                let step = self.session.recipe.step(step)?;
                if let Some(stage) = stage {
                    check_stage(&step.name, step.kind(), *stage)?;
                }
            }
        }
        source::keep_missing(&mut self.session)?;
        let mut walk = Walk::make(self, "build", forced, on_event).noting_failures();
        pipeline::everything(&mut walk)?;
        let reports = walk.into_reports();
        let verdicts = self.session.recipe.steps.iter().map(|step| verdict_on(step, &reports, None)).collect();
        Ok(Built { reports, verdicts })
    }
}

/// What a build made.
#[derive(Clone, Debug, PartialEq)]
pub struct Built {
    /// The stages that ran or were up to date.
    pub reports: Vec<StageReport>,
    /// The verdict on each step.
    pub verdicts: Vec<StepVerdict>,
}
