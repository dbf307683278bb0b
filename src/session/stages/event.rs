//! Progress and outcome of a stage.

use super::report::StageReport;
use super::verdict::StepVerdict;
use crate::fit;
use crate::scan::{FusionStep, Scan};
use crate::session::stage::Stage;
use crate::session::store::{Measures, Warning};

/// An event during a walk through the stages.
#[derive(Debug)]
pub enum Event<'a> {
    /// A stage begins.
    Started {
        /// Its step.
        step: &'a str,
        /// The stage.
        stage: Stage,
    },
    /// A stage has made progress.
    Progress {
        /// Its step.
        step: &'a str,
        /// The stage.
        stage: Stage,
        /// The progress, in words.
        text: &'a str,
    },
    /// A fit has finished an iteration.
    Iterated {
        /// Its step.
        step: &'a str,
        /// The stage.
        stage: Stage,
        /// The scan of the fit.
        scan: &'a Scan,
        /// The iteration.
        at: &'a fit::FitIteration<'a>,
    },
    /// The fusion of RGB-D frames has made progress.
    Fused {
        /// The step.
        step: &'a str,
        /// The part that was done.
        at: &'a FusionStep<'a>,
    },
    /// A stage has run, and its result is on disk.
    Ran(&'a StageReport),
    /// A stage was up to date.
    UpToDate(&'a StageReport),
    /// All stages of a step are up to date.
    StepDone(&'a StepVerdict),
}

/// The stages that run even if they are up to date.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Forced {
    /// None.
    #[default]
    Nothing,
    /// All.
    Everything,
    /// The stages of the named steps, or the named stages.
    Named(Vec<(String, Option<Stage>)>),
}

impl Forced {
    pub(super) fn includes(&self, step: &str, stage: Stage) -> bool {
        match self {
            Self::Nothing => false,
            Self::Everything => true,
            Self::Named(named) => named.iter().any(|(s, only)| s == step && only.is_none_or(|o| o == stage)),
        }
    }
}

/// The outcome of a stage.
pub(in crate::session) struct Outcome<T> {
    pub value: T,
    pub measures: Measures,
    pub findings: Vec<String>,
    pub warnings: Vec<Warning>,
}

impl<T> Outcome<T> {
    pub fn of(value: T) -> Self {
        Self { value, measures: Measures::new(), findings: Vec::new(), warnings: Vec::new() }
    }

    pub fn measured(mut self, name: &str, value: f64) -> Self {
        // JSON has no infinity; such measures are omitted.
        if value.is_finite() {
            self.measures.insert(name.into(), value);
        }
        self
    }

    pub fn found(mut self, findings: impl IntoIterator<Item = String>) -> Self {
        self.findings.extend(findings);
        self
    }

    pub fn warned(mut self, warnings: impl IntoIterator<Item = Warning>) -> Self {
        self.warnings.extend(warnings);
        self
    }
}

/// Progress of a running stage.
pub(in crate::session) enum StageProgress<'a> {
    /// Text.
    Text(&'a str),
    /// An iteration of a fit to this scan.
    Iteration(&'a Scan, &'a fit::FitIteration<'a>),
    /// A step of the fusion of frames.
    Fusion(&'a FusionStep<'a>),
}

impl StageProgress<'_> {
    pub(super) fn report(&self, step: &str, stage: Stage, on_event: &mut dyn FnMut(&Event)) {
        match *self {
            Self::Text(text) => on_event(&Event::Progress { step, stage, text }),
            Self::Iteration(scan, at) => on_event(&Event::Iterated { step, stage, scan, at }),
            Self::Fusion(at) => on_event(&Event::Fused { step, at }),
        }
    }
}

/// Callback for the progress of a stage.
pub(in crate::session) type OnProgress<'a> = &'a mut dyn FnMut(StageProgress);
