//! `overcoat status`: what stands, what is stale, what each step measured.

use super::Context;
use super::console::{Done, secs};
use super::progress::{measures_text, why_text};
use crate::session::{BodyModelSource, Stage, StepStatus};
use serde_json::json;
use std::time::{Duration, Instant};

#[derive(clap::Args)]
pub(super) struct StatusArgs {}

pub(super) fn run(_: StatusArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let session = context.reader()?;
    let steps = session.status()?;
    let body = match session.body_model_source() {
        BodyModelSource::Embedded => "embedded".to_string(),
        BodyModelSource::File(file) => file,
    };
    let stale: usize = steps.iter().map(|s| s.stale.len()).sum();
    let json = json!({
        "session": context.session.display().to_string(),
        "body_model": body,
        "branch": session.history().current().name,
        "up_to_date": stale == 0 && !steps.is_empty(),
        "steps": steps,
        "secs": began.elapsed().as_secs_f64(),
    });
    let mut done = Done::new("status", json).line(format!(
        "session {}: {} step{}, body model: {body} (looked through in {})",
        context.session.display(),
        steps.len(),
        if steps.len() == 1 { "" } else { "s" },
        secs(began.elapsed())
    ));
    for step in &steps {
        done = done.lines(lines_of(step));
    }
    Ok(match (steps.is_empty(), stale) {
        (true, _) => done.next(context.overcoat("scan body FILE")),
        (false, 0) => {
            done.next(context.overcoat("export character.glb")).next(context.overcoat("scan NAME FILE --template …"))
        }
        (false, _) => done.next(context.overcoat("build")),
    })
}

fn lines_of(step: &StepStatus) -> Vec<String> {
    let mark = |stage: &Stage| if step.stale.contains(stage) { format!("[ ] {stage}") } else { format!("[x] {stage}") };
    let stages: Vec<String> = Stage::of_step(step.template.is_none()).iter().map(mark).collect();
    let kind = step.template.as_ref().map(|t| format!(" ({t})")).unwrap_or_default();
    let mut lines =
        vec![String::new(), format!("{}{kind}  {}", step.name, step.scan), format!("  {}", stages.join("  "))];
    if step.scan_changed {
        lines.push("  the file is gone or was changed since it was scanned; the session uses its own copy".into());
    }
    if step.masks > 0 {
        lines.push(format!("  {} mask file{}", step.masks, if step.masks == 1 { "" } else { "s" }));
    }
    for (stage, why) in &step.why {
        let why = why_text(why).unwrap_or_else(|| "never ran".into());
        lines.push(format!("    {:<9} stale: {why}", stage.to_string()));
    }
    for report in &step.standing {
        let time = report.secs.map(|s| secs(Duration::from_secs_f64(s))).unwrap_or_default();
        lines.push(format!("    {:<9} {time:>8}  {}", report.stage.to_string(), measures_text(report)));
    }
    lines
}
