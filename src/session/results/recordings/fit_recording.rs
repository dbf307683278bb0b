//! Records the fits for the Rerun viewer: the scan of each step, the fitted surface at each iteration, and its distance
//! from the scan.

use super::recording::Shown;
use super::show_in::ShowIn;
use crate::fit::FitIteration;
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::pipeline::Event;
use crate::session::results::outputs::Outputs;
use crate::session::stage::Stage;
use crate::view::{Error, Paint, Part, Recording, layer_color};

/// An open recording of fits.
pub(in crate::session) struct FitRecording {
    shown: Shown,
    /// The current step and stage.
    now: Option<(String, Stage)>,
    iterations: usize,
}

impl FitRecording {
    /// Begins a recording.
    pub fn try_new(session: &str, to: &ShowIn, outputs: Outputs) -> Result<Self, SessionError> {
        let shown = Shown::begin(to, outputs, |sink| Recording::of_fits(session, sink))?;
        Ok(Self { shown, now: None, iterations: 0 })
    }

    /// Records an iteration, or the result of a fit.
    pub fn see(&mut self, event: &Event) {
        match event {
            Event::Iterated { step, stage, scan, at } => self.iterated(step, *stage, scan, at),
            Event::Ran(report) if [Stage::Fit, Stage::Register, Stage::Pose].contains(&report.stage) => {
                let mut notes = format!("# {}, {}\n", report.step, report.stage);
                notes.extend(report.measures.iter().map(|(name, value)| format!("- {name}: {value:.3}\n")));
                notes.extend(report.findings.iter().map(|finding| format!("- {finding}\n")));
                self.shown.note(|recording| recording.log_notes(&notes));
            }
            _ => {}
        }
    }

    fn iterated(&mut self, step: &str, stage: Stage, scan: &Scan, at: &FitIteration) {
        let is_new_step = self.now.as_ref().is_none_or(|(name, _)| name != step);
        let is_new_stage = is_new_step || self.now.as_ref().is_some_and(|(_, s)| *s != stage);
        if is_new_stage {
            self.now = Some((step.into(), stage));
        }
        self.iterations += 1;
        let iterations = self.iterations;
        self.shown.note(|recording| {
            recording.set_iteration(iterations);
            if is_new_step {
                recording.log_scan(&scanned(scan)?)?;
            }
            match is_new_stage {
                true => recording.log_fitted(&Part::solid(at.surface, layer_color(0)))?,
                false => recording.log_fitted_moved(at.surface)?,
            }
            recording.log_measure("residual_mm", 1e3 * at.residual)?;
            recording.log_measure("moved_mm", 1e3 * at.moved)
        });
    }

    /// Ends the recording.
    pub fn finish(self) -> Result<(), SessionError> {
        self.shown.finish()
    }
}

/// The scan, translucent, so that the fitted surface inside is visible.
fn scanned(scan: &Scan) -> Result<Part<'_>, Error> {
    const OPACITY: f64 = 0.35;
    let part = match &scan.colors {
        Some(colors) => Part::try_new(&scan.mesh, Paint::PerVertex(colors))?,
        None => Part::solid(&scan.mesh, [170, 170, 170]),
    };
    Ok(part.with_opacity(OPACITY))
}
