//! What a running stage reports, and what it leaves behind.

use super::reason::Reason;
use crate::fit;
use crate::scan::{FusionStep, Scan};
use crate::session::stage::Stage;
use crate::session::store::Measures;
use serde::Serialize;

/// What happens while stages run.
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
        /// How far it is, in words.
        text: &'a str,
    },
    /// A fit has finished an iteration.
    Iterated {
        /// Its step.
        step: &'a str,
        /// The stage.
        stage: Stage,
        /// What is fitted to.
        scan: &'a Scan,
        /// The iteration.
        at: &'a fit::FitIteration<'a>,
    },
    /// The fusion of RGB-D frames has made progress.
    Fused {
        /// The step.
        step: &'a str,
        /// What was done.
        at: &'a FusionStep<'a>,
    },
    /// A stage has run, and its result is on disk.
    Ran(&'a StageReport),
    /// A stage was up to date.
    UpToDate(&'a StageReport),
}

/// A stage after a walk.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StageReport {
    /// Its step.
    pub step: String,
    /// The stage.
    pub stage: Stage,
    /// Whether it ran now; else it was up to date.
    pub ran: bool,
    /// Why it ran now.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub why: Vec<Reason>,
    /// How long it took when it last ran, in seconds.
    pub secs: Option<f64>,
    /// What it measured.
    pub measures: Measures,
    /// What it assumed or noticed.
    pub findings: Vec<String>,
}

/// Which stages run although they are up to date.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Forced {
    /// None.
    #[default]
    Nothing,
    /// All.
    Everything,
    /// Those of the named steps, or the named single stages.
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

/// What a stage leaves behind.
pub(in crate::session) struct Outcome<T> {
    pub value: T,
    pub measures: Measures,
    pub findings: Vec<String>,
}

impl<T> Outcome<T> {
    pub fn of(value: T) -> Self {
        Self { value, measures: Measures::new(), findings: Vec::new() }
    }

    pub fn measured(mut self, name: &str, value: f64) -> Self {
        // JSON has no infinity; what cannot be measured is left out.
        if value.is_finite() {
            self.measures.insert(name.into(), value);
        }
        self
    }

    pub fn found(mut self, findings: impl IntoIterator<Item = String>) -> Self {
        self.findings.extend(findings);
        self
    }
}

/// Progress of a running stage.
pub(in crate::session) enum StageProgress<'a> {
    /// In words.
    Text(&'a str),
    /// An iteration of a fit to this scan.
    Iteration(&'a Scan, &'a fit::FitIteration<'a>),
    /// A part of the fusion of frames.
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

/// How a stage reports its progress.
pub(in crate::session) type OnProgress<'a> = &'a mut dyn FnMut(StageProgress);
