//! `overcoat status`: the session in text: the verdict on each step, what is out of date and why, what to do next.

use super::console::{Context, Done, Verbosity, measures_text, secs, why_text};
use crate::check::{Attained, Judged, Verdict};
use crate::cloth::ClothMode;
use crate::session::{AnimationStatus, BodyModelSource, Session, SessionError, Stage, StepStatus, name_and_unit};
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
    let out_of_date: usize = steps.iter().map(|s| s.out_of_date.len()).sum();
    let animations = session.animations()?;
    let waiting = animations.iter().filter(|animation| animation.made.is_none()).count();
    let json = json!({
        "session": context.session.display().to_string(),
        "body_model": body,
        "recipe": session.recipe().hash()?.to_string(),
        "branch": session.history().current().name,
        "last_change": session.history().current().head(),
        "edited_by_hand": session.is_edited_by_hand(),
        "up_to_date": out_of_date + waiting == 0 && !steps.is_empty(),
        "steps": steps,
        "animations": animations,
        "secs": began.elapsed().as_secs_f64(),
    });
    let mut done = Done::new("status", json).lines(head(&session, context, &body));
    let verbose = context.console.verbosity == Verbosity::Verbose;
    let of_animations = animations.iter().flat_map(moving);
    let pictures: Vec<String> = steps.iter().flat_map(|step| picture(step, verbose)).chain(of_animations).collect();
    let has_marks = pictures.iter().any(|line| line.contains(['■', '□']));
    done = done.lines(pictures).line("").line(foot(&steps, waiting, animations.len(), began));
    if has_marks {
        done = done.line("■ up to date  □ out of date  · waits for an earlier stage");
    }
    done.next = next(&steps, waiting, context);
    Ok(done)
}

fn head(session: &Session, context: &Context, body: &str) -> Vec<String> {
    let branch = session.history().current();
    let at = match branch.head() {
        Some(entry) => format!("after {}: {}", entry.number, entry.change),
        None => "no change yet".into(),
    };
    let mut lines = vec![
        format!("session {}, body model: {body}", context.session.display()),
        format!("branch {} of {}, {at}", branch.name, session.history().branches().len()),
    ];
    if session.is_edited_by_hand() {
        lines.push("recipe.toml was edited by hand; the next change or build records that".into());
    }
    lines
}

/// Whether a stage is up to date, out of date, or waits for one that is.
fn mark(step: &StepStatus, stage: Stage) -> &'static str {
    match (step.out_of_date.contains(&stage), step.why.contains_key(&stage)) {
        (false, _) => "■",
        (true, true) => "□",
        (true, false) => "·",
    }
}

fn picture(step: &StepStatus, verbose: bool) -> Vec<String> {
    let file = std::path::Path::new(&step.scan).file_name().map(|f| f.to_string_lossy().into_owned());
    let kind = step.template.as_ref().filter(|t| **t != step.name).map(|t| format!(", {t}")).unwrap_or_default();
    let masks = match step.masks {
        0 => String::new(),
        1 => ", 1 mask".into(),
        n => format!(", {n} masks"),
    };
    let mut stages: Vec<Stage> =
        step.up_to_date.iter().map(|report| report.stage).chain(step.out_of_date.clone()).collect();
    stages.sort();
    let chain: Vec<String> = stages.into_iter().map(|s| format!("{} {s}", mark(step, s))).collect();
    let verdict = match &step.verdict {
        Some(verdict) => verdict.to_string(),
        None => "out of date".into(),
    };
    let mut lines = vec![
        String::new(),
        format!("{}: {verdict}", step.name),
        format!("  {}{kind}{masks}", file.unwrap_or_default()),
    ];
    lines.extend(step.notes.iter().map(|note| format!("  {note}")));
    lines.extend(step.warnings.iter().skip(1).map(|warning| format!("  also: {warning}")));
    if verbose || step.verdict.is_none() || matches!(step.verdict, Some(Verdict::Failed(_))) {
        lines.push(format!("  {}", chain.join(" ── ")));
    }
    if step.scan_changed {
        lines.push("  the file is missing or was changed after the scan; the session uses its own copy".into());
    }
    let failed = matches!(step.verdict, Some(Verdict::Failed(_)));
    for (stage, why) in step.why.iter().filter(|_| !failed) {
        let why = why_text(why).unwrap_or_else(|| "never ran".into());
        lines.push(format!("  □ {stage}: {why}"));
    }
    if verbose {
        lines.extend(step.judged.iter().map(measure_line));
        for report in &step.up_to_date {
            let time = report.secs.map(|s| secs(Duration::from_secs_f64(s))).unwrap_or_default();
            lines.push(format!("    {:<9} {time:>8}  {}", report.stage.to_string(), measures_text(report)));
        }
    }
    lines
}

/// An animation in a few lines.
fn moving(animation: &AnimationStatus) -> Vec<String> {
    let AnimationStatus { name, clip, mode, made, cloth, why, failed, clip_changed } = animation;
    let verdict = match (made, failed) {
        (Some(_), _) => "up to date".to_string(),
        (None, Some(what)) => format!("failed: {what}"),
        (None, None) => "out of date".into(),
    };
    let file = if clip == name { "ours" } else { clip.rsplit('/').next().unwrap_or_default() };
    let moves = match (mode, cloth) {
        (ClothMode::Skinned, _) => "skinned only".to_string(),
        (mode, None) => cloth_of(*mode).into(),
        (mode, Some(report)) => {
            let checked = match report.measures.get("crossing_pairs") {
                Some(pairs) => format!("{pairs:.0} pairs of faces cross"),
                None => "a draft".into(),
            };
            format!("{}, {checked}", cloth_of(*mode))
        }
    };
    let mut lines = vec![String::new(), format!("animation {name}: {verdict}"), format!("  {file}, {moves}")];
    if let Some(why) = why_text(why).filter(|_| made.is_none() && failed.is_none()) {
        lines.push(format!("  □ {why}"));
    }
    if *clip_changed {
        lines.push("  the file is missing or was changed since; the session uses its own copy".into());
    }
    lines
}

fn cloth_of(mode: ClothMode) -> &'static str {
    match mode {
        ClothMode::Skinned | ClothMode::Coupled => "with cloth",
        ClothMode::Physics => "with cloth by physics alone",
        ClothMode::Blended => "with cloth blended afterwards",
    }
}

fn measure_line(judged: &Judged) -> String {
    let mark = match judged.attained {
        Attained::Goal => "✓",
        Attained::Acceptable => "acceptable",
        Attained::Missed => "✗",
    };
    let value =
        if judged.value.fract() == 0.0 { format!("{:.0}", judged.value) } else { format!("{:.2}", judged.value) };
    let (name, unit) = name_and_unit(&judged.measure);
    format!("    {:<9} {name:<20} {value:>8}{unit}   {judged}{unit} {mark}", judged.stage)
}

fn foot(steps: &[StepStatus], waiting: usize, animations: usize, began: Instant) -> String {
    let (out_of_date, all) = (
        steps.iter().map(|s| s.out_of_date.len()).sum::<usize>() + waiting,
        steps.iter().map(|s| s.out_of_date.len() + s.up_to_date.len()).sum::<usize>() + animations,
    );
    let took = secs(began.elapsed());
    match (steps.is_empty(), out_of_date) {
        (true, _) => format!("nothing is scanned yet (checked in {took})"),
        (false, 0) => format!("all {all} stages are up to date (checked in {took})"),
        (false, _) => format!("{out_of_date} of {all} stages are out of date (checked in {took})"),
    }
}

/// What to do next in a session as it is now.
pub(super) fn next_in(session: &Session, context: &Context) -> Result<Vec<String>, SessionError> {
    let waiting = session.animations()?.iter().filter(|animation| animation.made.is_none()).count();
    Ok(next(&session.status()?, waiting, context))
}

/// What to do next: what is missing, then what is in doubt, then what comes after.
fn next(steps: &[StepStatus], waiting: usize, context: &Context) -> Vec<String> {
    if steps.is_empty() {
        return vec![context.overcoat("scan body FILE")];
    }
    if let Some(failed) = steps.iter().find(|s| matches!(s.verdict, Some(Verdict::Failed(_)))) {
        let name = &failed.name;
        return vec![
            context.overcoat("view --sheet sheet.png"),
            context.overcoat(&format!("scan {name} FILE --replace")),
            context.overcoat(&format!("step remove {name}")),
        ];
    }
    if waiting > 0 || steps.iter().any(|s| !s.out_of_date.is_empty()) {
        return vec![context.overcoat("build")];
    }
    if steps.iter().any(|s| s.verdict.as_ref().is_some_and(|verdict| !verdict.is_good())) {
        return vec![context.overcoat("view --sheet sheet.png")];
    }
    vec![context.overcoat("export character.glb"), context.overcoat("scan NAME FILE --template …")]
}
