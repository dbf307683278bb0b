//! The tables of a report: layers, measures, timings, provenance.

use super::html::{escaped, table};
use crate::check::{Attained, Judged};
use crate::session::BodyModelSource;
use crate::session::{Session, Shown, ShownStep, Stage, StageReport, girth_notes, name_and_unit};
use crate::tryon::Ease;

/// A line per layer of the figure: kind, fabric, size, hems, weights, how wide it is.
pub(super) fn layers(shown: &Shown, eases: &[(String, Ease)]) -> String {
    let Some(figure) = &shown.figure else { return String::new() };
    let row = |layer: &crate::body::Layer| {
        let step = shown.steps.iter().find(|step| step.status.name == layer.name);
        let hems = step.and_then(|step| judged(step, "hem_loops")).map(hem_text).unwrap_or_else(|| "–".into());
        let physics = layer.physics.as_ref().map_or_else(
            || "moves with the skeleton".to_string(),
            |shares| {
                let (least, most) = shares.iter().fold((1.0, 0.0), |(a, b): (f64, f64), s| (a.min(*s), b.max(*s)));
                format!("{least:.2} to {most:.2}")
            },
        );
        let seen = match &layer.is_seen {
            None => "100 %".to_string(),
            Some(seen) => {
                let count = seen.iter().filter(|seen| **seen).count();
                format!("{:.0} %", 100.0 * count as f64 / seen.len().max(1) as f64)
            }
        };
        let ease = eases.iter().find(|(name, _)| *name == layer.name).map(|(_, ease)| girth_notes(ease));
        let ease: Vec<String> = ease.into_iter().flatten().map(|note| escaped(&note.replace('\t', ": "))).collect();
        vec![
            escaped(&layer.name),
            escaped(layer.template.as_deref().unwrap_or("body")),
            escaped(layer.fabric.as_deref().unwrap_or("–")),
            format!("{} vertices, {} faces", layer.mesh.vertex_count(), layer.mesh.face_count()),
            hems,
            seen,
            physics,
            if ease.is_empty() { "–".into() } else { ease.join("<br>") },
        ]
    };
    let rows: Vec<Vec<String>> = figure.layers.iter().map(row).collect();
    let head = [
        "layer",
        "kind",
        "fabric",
        "size",
        "hems",
        "seen in the scan",
        "physics weights",
        "ease: own girth less the body's, and air",
    ];
    table(&head, &rows)
}

fn judged<'a>(step: &'a ShownStep, measure: &str) -> Option<&'a Judged> {
    step.status.judged.iter().find(|judged| judged.measure == measure)
}

fn hem_text(judged: &Judged) -> String {
    format!("{} found, {judged} expected {}", judged.value, mark(judged.attained))
}

fn mark(attained: Attained) -> &'static str {
    match attained {
        Attained::Goal => "<span class=\"good\">✓</span>",
        Attained::Acceptable => "acceptable",
        Attained::Missed => "<span class=\"bad\">✗ missed</span>",
    }
}

/// The measures of a step that have limits.
pub(super) fn measures(step: &ShownStep) -> String {
    let row = |judged: &Judged| {
        let (name, unit) = name_and_unit(&judged.measure);
        let digits = if judged.value.fract() == 0.0 { 0 } else { 2 };
        vec![
            escaped(&name),
            judged.stage.to_string(),
            format!("{:.digits$}{unit}", judged.value),
            format!("{}{unit}", escaped(&judged.to_string())),
            mark(judged.attained).into(),
        ]
    };
    let rows: Vec<Vec<String>> = step.status.judged.iter().map(row).collect();
    if rows.is_empty() { String::new() } else { table(&["measure", "stage", "value", "limit", ""], &rows) }
}

/// What the stages of a step assumed and observed.
pub(super) fn findings(step: &ShownStep) -> String {
    let of = |report: &StageReport| {
        let stage = report.stage.name();
        report.findings.iter().map(|finding| format!("<li>{stage}: {}</li>", escaped(finding))).collect::<String>()
    };
    let items: String = step.status.up_to_date.iter().map(of).collect();
    if items.is_empty() {
        items
    } else {
        format!("<details><summary>What was found and assumed</summary><ul>{items}</ul></details>")
    }
}

/// The duration of each stage's last run, and the sums.
pub(super) fn timings(shown: &Shown) -> String {
    let mut stages: Vec<Stage> = shown.steps.iter().flat_map(|s| s.status.up_to_date.iter().map(|r| r.stage)).collect();
    stages.sort_unstable();
    stages.dedup();
    let secs_of =
        |step: &ShownStep, stage: Stage| step.status.up_to_date.iter().find(|r| r.stage == stage).and_then(|r| r.secs);
    let text = |secs: Option<f64>| secs.map_or_else(|| "–".to_string(), |secs| format!("{secs:.2}"));
    let mut rows = Vec::new();
    for &stage in &stages {
        let of_steps: Vec<Option<f64>> = shown.steps.iter().map(|step| secs_of(step, stage)).collect();
        let sum: f64 = of_steps.iter().flatten().sum();
        let cells = of_steps.into_iter().map(text);
        rows.push(std::iter::once(stage.name().to_string()).chain(cells).chain([format!("{sum:.2}")]).collect());
    }
    let totals: Vec<f64> =
        shown.steps.iter().map(|step| stages.iter().filter_map(|&stage| secs_of(step, stage)).sum()).collect();
    let sum: f64 = totals.iter().sum();
    let cells = totals.iter().map(|total| format!("{total:.2}"));
    rows.push(std::iter::once("all".to_string()).chain(cells).chain([format!("{sum:.2}")]).collect());
    let names: Vec<String> = shown.steps.iter().map(|step| escaped(&step.status.name)).collect();
    let head: Vec<&str> = std::iter::once("seconds").chain(names.iter().map(String::as_str)).chain(["all"]).collect();
    table(&head, &rows)
}

/// Where everything comes from.
pub(super) fn provenance(shown: &Shown, session: &Session) -> String {
    let mut rows = Vec::new();
    for step in &shown.steps {
        let hash = step.hash.map_or_else(|| "–".to_string(), |hash| hash.to_string());
        rows.push(vec![format!("scan of {}", escaped(&step.status.name)), escaped(&step.file), hash]);
    }
    let model = match session.body_model_source() {
        BodyModelSource::Embedded => "embedded".to_string(),
        BodyModelSource::File(file) => {
            let name = file.rsplit(['/', '\\']).next().unwrap_or_default();
            escaped(name)
        }
    };
    rows.push(vec!["body model".into(), model, "–".into()]);
    if let Some((number, change)) = &shown.change {
        let recipe = shown.recipe.map_or_else(|| "–".to_string(), |hash| hash.to_string());
        rows.push(vec!["recipe".into(), format!("after change {number}: {}", escaped(change)), recipe]);
    }
    rows.push(vec!["program".into(), format!("Overcoat {}", env!("CARGO_PKG_VERSION")), "–".into()]);
    table(&["what", "source", "BLAKE3"], &rows)
}
