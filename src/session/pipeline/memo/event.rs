//! Progress and outcome of a stage.

use super::report::StageReport;
use crate::body::Figure;
use crate::check::StepVerdict;
use crate::fit;
use crate::geometry::Point;
use crate::scan::{FusionStep, Scan};
use crate::session::stage::Stage;
use crate::session::store::{Kept, Measures, StageRecord, Warning};
use std::time::Duration;

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
    /// Cloth has moved by a frame.
    Moved {
        /// The frame.
        at: &'a MovedFrame<'a>,
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
    pub(in crate::session::pipeline) fn includes(&self, step: &str, stage: Stage) -> bool {
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
    /// How long the stage ran, if it was begun before it was asked for.
    pub duration: Option<Duration>,
}

impl<T> Outcome<T> {
    pub fn of(value: T) -> Self {
        Self { value, measures: Measures::new(), findings: Vec::new(), warnings: Vec::new(), duration: None }
    }

    pub fn lasting(self, duration: Duration) -> Self {
        Self { duration: Some(duration), ..self }
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

/// The result of a stage, made now or earlier.
pub(in crate::session) struct Made<T> {
    pub kept: Kept<T>,
    pub measures: Measures,
}

impl<T> Made<T> {
    pub fn of(record: &StageRecord) -> Self {
        Self { kept: Kept::named(record.output), measures: record.measures.clone() }
    }
}

/// A frame of cloth, as soon as it is computed.
#[derive(Debug)]
pub struct MovedFrame<'a> {
    /// The figure that moves.
    pub figure: &'a Figure,
    /// Frames per second.
    pub fps: f64,
    /// Its number.
    pub frame: usize,
    /// Where every vertex of the figure is, one layer after another, metres.
    pub at: &'a [Point],
}

/// Progress of a running stage.
pub(in crate::session) enum StageProgress<'a> {
    /// Text.
    Text(&'a str),
    /// An iteration of a fit to this scan.
    Iteration(&'a Scan, &'a fit::FitIteration<'a>),
    /// A step of the fusion of frames.
    Fusion(&'a FusionStep<'a>),
    /// A frame of cloth.
    Moved(&'a MovedFrame<'a>),
}

/// Passes the progress of one run of a stage on as events. A stage may fit several times, for example again without a limb that
/// the scan does not show; its iterations are numbered from 1 without a gap.
pub(in crate::session::pipeline) fn as_events<'a>(
    step: &'a str,
    stage: Stage,
    on_event: &'a mut dyn FnMut(&Event),
) -> impl FnMut(StageProgress) + 'a {
    let mut iterations = 0;
    move |progress| match progress {
        StageProgress::Text(text) => on_event(&Event::Progress { step, stage, text }),
        StageProgress::Iteration(scan, at) => {
            iterations += 1;
            on_event(&Event::Iterated { step, stage, scan, at: &fit::FitIteration { iteration: iterations, ..*at } });
        }
        StageProgress::Fusion(at) => on_event(&Event::Fused { step, at }),
        StageProgress::Moved(at) => on_event(&Event::Moved { at }),
    }
}

/// Callback for the progress of a stage.
pub(in crate::session) type OnProgress<'a> = &'a mut dyn FnMut(StageProgress);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, TriMesh};

    #[test]
    fn iterations_are_numbered_without_a_gap_where_a_fit_begins_anew() {
        let surface = TriMesh::try_from_indices(vec![Point::origin()], &[]).unwrap();
        let scan = Scan::from_clean_mesh(surface.clone(), None);
        let mut numbers = Vec::new();
        let mut on_event = |event: &Event| {
            if let Event::Iterated { at, .. } = event {
                numbers.push(at.iteration);
            }
        };
        for _ in 0..2 {
            let mut progress = as_events("body", Stage::Fit, &mut on_event);
            for iteration in [1, 2, 1, 24, 38] {
                let at = fit::FitIteration { iteration, moved: 0.0, residual: 0.0, surface: &surface };
                progress(StageProgress::Iteration(&scan, &at));
            }
        }
        assert_eq!(numbers, [1, 2, 3, 4, 5, 1, 2, 3, 4, 5]);
    }
}
