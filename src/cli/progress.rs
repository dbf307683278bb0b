//! How a long command is going: a bar on a terminal, plain lines elsewhere.

use super::console::{Console, Verbosity, print_aside, secs};
use crate::session::{Event, StageReport};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::Duration;

/// Shows stages as they run.
pub(super) struct Progress {
    bar: Option<ProgressBar>,
    /// A line for each stage.
    plain: bool,
    verbosity: Verbosity,
}

/// How often the spinner moves: often enough to be seen alive.
const TICK: Duration = Duration::from_millis(120);

impl Progress {
    /// For a command whose own line says all of it: only the bar.
    pub fn quiet_bar(console: &Console) -> Self {
        let mut progress = Self::new(console);
        progress.plain = console.verbosity == Verbosity::Verbose;
        progress
    }

    pub fn new(console: &Console) -> Self {
        let wanted = console.verbosity > Verbosity::Quiet && std::io::stderr().is_terminal();
        let bar = wanted.then(|| {
            let bar = ProgressBar::new_spinner();
            if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed:>4} {wide_msg}") {
                bar.set_style(style);
            }
            bar.enable_steady_tick(TICK);
            bar
        });
        Self { bar, plain: true, verbosity: console.verbosity }
    }

    pub fn show(&mut self, event: &Event) {
        match (&self.bar, event) {
            (_, Event::Ran(_)) if !self.plain => {}
            _ if self.verbosity == Verbosity::Quiet => {}
            (Some(bar), Event::Started { step, stage }) => bar.set_message(format!("{step}: {stage}")),
            (Some(bar), Event::Progress { step, stage, text }) => bar.set_message(format!("{step}: {stage}, {text}")),
            (Some(bar), Event::Ran(report)) => bar.suspend(|| print_aside(&ran(report))),
            (None, Event::Ran(report)) => print_aside(&ran(report)),
            (None, Event::Progress { step, stage, text }) if self.verbosity == Verbosity::Verbose => {
                print_aside(&format!("{step}: {stage}, {text}"));
            }
            (None, _) => {}
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

fn ran(report: &StageReport) -> String {
    let time = report.secs.map(|s| secs(Duration::from_secs_f64(s))).unwrap_or_default();
    let measures = measures_text(report);
    let separator = if measures.is_empty() { "" } else { ": " };
    format!("{:<12} {:<9} {time:>8}{separator}{measures}", report.step, report.stage.to_string())
}

/// Measures as `name value` in one line.
pub(super) fn measures_text(report: &StageReport) -> String {
    report.measures.iter().map(|(name, value)| format!("{name} {}", number(*value))).collect::<Vec<_>>().join(", ")
}

fn number(value: f64) -> String {
    match value {
        v if v == v.trunc() && v.abs() < 1e9 => format!("{v:.0}"),
        v if v.abs() < 0.01 => format!("{v:.1e}"),
        v if v.abs() < 10.0 => format!("{v:.2}"),
        v => format!("{v:.1}"),
    }
}
