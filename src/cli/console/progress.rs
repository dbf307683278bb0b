//! Progress of a long command: a bar on a terminal, plain lines elsewhere.

use super::output::{Console, Verbosity, print_aside, secs};
use super::verdicts;
use crate::fit::FitIteration;
use crate::session::{Cause, Event, Reason, StageReport, name_and_unit};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::Duration;

/// Shows stages as they run.
pub(in crate::cli) struct Progress {
    bar: Option<ProgressBar>,
    /// A line per step, and with `-v` per stage.
    plain: bool,
    /// Whether any stage has run.
    ran: bool,
    verbosity: Verbosity,
}

/// Interval of the spinner: short enough to show that the program is working.
const TICK: Duration = Duration::from_millis(120);

impl Progress {
    /// For a command of one stage, whose own line reports everything.
    pub fn of_one_stage(console: &Console) -> Self {
        Self {
            bar: shown_bar(console, None),
            plain: console.verbosity == Verbosity::Verbose,
            ran: false,
            verbosity: console.verbosity,
        }
    }

    /// For a command of `count` stages, with a line per step; with `-v` also per stage that runs.
    pub fn of_stages(console: &Console, count: usize) -> Self {
        Self { bar: shown_bar(console, Some(count)), plain: true, ran: false, verbosity: console.verbosity }
    }

    pub fn show(&mut self, event: &Event) {
        self.ran |= matches!(event, Event::Ran(_));
        if let (Some(bar), Event::Ran(_) | Event::UpToDate(_)) = (&self.bar, event) {
            bar.inc(1);
        }
        match (&self.bar, event) {
            _ if self.verbosity == Verbosity::Quiet => {}
            (Some(bar), Event::Started { step, stage }) => bar.set_message(format!("{step}: {stage}")),
            (Some(bar), Event::Progress { step, stage, text }) => bar.set_message(format!("{step}: {stage}, {text}")),
            (Some(bar), Event::Iterated { step, stage, at, .. }) => {
                bar.set_message(format!("{step}: {stage}, {}", iterated(at)));
            }
            (Some(bar), Event::Ran(report)) if self.prints_stages() => bar.suspend(|| print_aside(&ran(report))),
            (None, Event::Ran(report)) if self.prints_stages() => print_aside(&ran(report)),
            (Some(bar), Event::StepDone(step)) if self.plain && self.ran => {
                bar.suspend(|| print_aside(&verdicts::line_for_stderr(step)))
            }
            (None, Event::StepDone(step)) if self.plain && self.ran => print_aside(&verdicts::line_for_stderr(step)),
            (None, Event::Progress { step, stage, text }) if self.verbosity == Verbosity::Verbose => {
                print_aside(&format!("{step}: {stage}, {text}"));
            }
            (None, Event::Iterated { step, stage, at, .. }) if self.verbosity == Verbosity::Verbose => {
                print_aside(&format!("{step}: {stage}, {}", iterated(at)));
            }
            _ => {}
        }
    }

    fn prints_stages(&self) -> bool {
        self.plain && self.verbosity == Verbosity::Verbose
    }

    /// Shows work that is not a stage of a session.
    pub fn describe(&mut self, text: String) {
        match &self.bar {
            Some(bar) => bar.set_message(text),
            None if self.verbosity == Verbosity::Verbose => print_aside(&text),
            None => {}
        }
    }

    /// Says something at once that is worth knowing before the end.
    pub fn say(&self, text: &str) {
        match &self.bar {
            _ if self.verbosity == Verbosity::Quiet => {}
            Some(bar) => bar.suspend(|| print_aside(text)),
            None => print_aside(text),
        }
    }

    pub fn end(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.end();
    }
}

fn shown_bar(console: &Console, stages: Option<usize>) -> Option<ProgressBar> {
    if console.verbosity == Verbosity::Quiet || !std::io::stderr().is_terminal() {
        return None;
    }
    let (bar, template) = match stages {
        Some(count) => (ProgressBar::new(count as u64), "{bar:24} {pos}/{len} {elapsed:>4} {wide_msg}"),
        None => (ProgressBar::new_spinner(), "{spinner} {elapsed:>4} {wide_msg}"),
    };
    bar.set_style(ProgressStyle::with_template(template).expect("both templates above are well formed"));
    bar.enable_steady_tick(TICK);
    Some(bar)
}

fn iterated(at: &FitIteration) -> String {
    format!("iteration {}: {:.1} mm off, moved {:.1} mm", at.iteration, at.residual * 1e3, at.moved * 1e3)
}

fn ran(report: &StageReport) -> String {
    let time = report.secs.map(|s| secs(Duration::from_secs_f64(s))).unwrap_or_default();
    let measures = measures_text(report);
    let separator = if measures.is_empty() { "" } else { ": " };
    let why = why_text(&report.why).map(|why| format!("  [{why}]")).unwrap_or_default();
    let findings: String = report.findings.iter().map(|finding| format!("\n    {finding}")).collect();
    format!("  {:<12} {:<9} {time:>8}{separator}{measures}{why}{findings}", report.step, report.stage.to_string())
}

/// Why a stage is out of date; empty for a stage that never ran.
pub(in crate::cli) fn why_text(why: &[Reason]) -> Option<String> {
    let said: Vec<String> = why.iter().filter(|r| r.cause != Cause::NeverRan).map(Reason::to_string).collect();
    (!said.is_empty()).then(|| said.join(", "))
}

/// All measures with their units in one line.
pub(in crate::cli) fn measures_text(report: &StageReport) -> String {
    let measures = report.measures.iter().filter(|(name, _)| *name != "converged");
    measures.map(|(name, value)| measure_text(name, *value)).chain(not_converged(report)).collect::<Vec<_>>().join(", ")
}

/// Fits are expected to converge; only a fit that did not is reported.
fn not_converged(report: &StageReport) -> Option<String> {
    let iterations = report.measures.get("iterations")?;
    let failed = report.measures.get("converged") == Some(&0.0);
    failed.then(|| format!("did not converge in {iterations:.0} iterations: check this step"))
}

fn measure_text(measure: &str, value: f64) -> String {
    let (name, unit) = name_and_unit(measure);
    format!("{name} {}{unit}", number(value))
}

fn number(value: f64) -> String {
    match value {
        v if v == v.trunc() && v.abs() < 1e9 => format!("{v:.0}"),
        v if v.abs() < 0.01 => format!("{v:.1e}"),
        v if v.abs() < 10.0 => format!("{v:.2}"),
        v => format!("{v:.1}"),
    }
}
