//! `overcoat measure`: compares the session with ground truth.

use super::console::{Context, Done, secs};
use crate::session::{SubjectOrigin, TruthReport};
use anyhow::Context as _;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct MeasureArgs {
    /// Folder with K_body.ply, K_layerJ.ply, joints.json and bind_*.ply, in the frame of the scan files
    #[arg(long, value_name = "DIR")]
    truth: PathBuf,
    /// The subject was generated from Overcoat's own body model: stricter limits apply
    #[arg(long)]
    invented: bool,
}

pub(super) fn run(args: MeasureArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let subject = if args.invented { SubjectOrigin::Invented } else { SubjectOrigin::Foreign };
    let truth = context.input(args.truth);
    let report = context.reader()?.measure(&truth, subject)?;
    let mut json = json!({
        "session": context.session.display().to_string(),
        "truth": truth.display().to_string(),
        "secs": began.elapsed().as_secs_f64(),
    });
    if let (Value::Object(object), Value::Object(measures)) =
        (&mut json, serde_json::to_value(&report).context("the measures cannot be written as JSON")?)
    {
        object.extend(measures);
    }
    Ok(Done::new("measure", json).lines(lines_of(&report)).line(format!(
        "measured {} steps in {}",
        report.steps.len(),
        secs(began.elapsed())
    )))
}

/// The measures of each step, then those with a limit.
pub(super) fn lines_of(report: &TruthReport) -> Vec<String> {
    let mut lines = Vec::new();
    for step in &report.steps {
        let measures = match serde_json::to_value(step) {
            Ok(Value::Object(object)) => object,
            _ => continue,
        };
        lines.push(format!("step {} {}", step.step, step.name));
        lines.extend(
            measures
                .iter()
                .filter(|(name, _)| *name != "step")
                .filter_map(|(name, value)| Some(format!("  {name:<32} {:>10.3}", value.as_f64()?))),
        );
    }
    lines.push("measures with a limit".into());
    for target in &report.targets {
        let verdict = match (target.meets_goal, target.meets_first) {
            (true, _) => "✓",
            (false, true) => "acceptable",
            (false, false) => "✗ missed",
        };
        let acceptable = target.first.map_or(String::new(), |v| format!(", acceptable {v}"));
        lines.push(format!(
            "  {:<36} {:>10.3}   goal {}{acceptable}: {verdict}",
            target.metric, target.value, target.goal
        ));
    }
    lines
}
