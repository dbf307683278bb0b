//! `overcoat measure`: compares the session with ground truth.

use super::console::{Context, Done, secs};
use crate::session::{SessionError, SubjectOrigin, TruthReport};
use anyhow::Context as _;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct MeasureArgs {
    /// Folder with K_body.ply, K_layerJ.ply, joints.json and bind_*.ply, in the frame of the scan files
    #[arg(long, value_name = "DIR", required_unless_present = "labels")]
    truth: Option<PathBuf>,
    /// The subject was generated from Overcoat's own body model: stricter limits apply
    #[arg(long, requires = "truth")]
    invented: bool,
    /// True labels of one garment instead: .npy, .ply, .png or .jsonl, as `mask` takes them
    #[arg(long, value_name = "FILE", requires = "layer", conflicts_with = "truth")]
    labels: Option<PathBuf>,
    /// The garment whose labels are compared
    #[arg(long, value_name = "LAYER", requires = "labels")]
    layer: Option<String>,
    /// The garment's class in a file with labels of several classes; several as 3,4
    #[arg(long, value_name = "N", value_delimiter = ',', requires = "labels")]
    class: Vec<i64>,
}

pub(super) fn run(args: MeasureArgs, context: &Context) -> anyhow::Result<Done> {
    match (&args.truth, &args.labels, &args.layer) {
        (Some(truth), ..) => against_folder(truth.clone(), args.invented, context),
        (None, Some(labels), Some(layer)) => against_labels(labels.clone(), layer, &args.class, context),
        // The parser has already checked that one of them is present.
        _ => Err(SessionError::BadRequest {
            what: "measure needs a truth".into(),
            hint: "give --truth or --labels".into(),
        }
        .into()),
    }
}

fn against_labels(file: PathBuf, layer: &str, classes: &[i64], context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let file = context.input(file);
    let found = context.reader()?.measure_labels(layer, &file, classes)?;
    let mut json = json!(found);
    json["session"] = context.session.display().to_string().into();
    json["layer"] = layer.into();
    json["labels"] = file.display().to_string().into();
    json["secs"] = began.elapsed().as_secs_f64().into();
    let percent = |share: f64| 100.0 * share;
    Ok(Done::new("measure", json).line(format!(
        "{layer}: {:.1} % of what is the garment by either is by both (IoU); {:.1} % of what was found is right, {:.1} % of what is there was found",
        percent(found.iou), percent(found.precision), percent(found.recall),
    )).line(format!("compared {} vertices of the scan in {}", found.vertices, secs(began.elapsed()))))
}

fn against_folder(truth: PathBuf, invented: bool, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let subject = if invented { SubjectOrigin::Invented } else { SubjectOrigin::Foreign };
    let truth = context.input(truth);
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
