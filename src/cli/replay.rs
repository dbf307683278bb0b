//! `overcoat replay`: runs a recipe in a new session, or for many people.

use super::console::{Context, Done, Progress, Verbosity, print_aside, secs, verdicts};
use super::failure;
use crate::desk::{people_page, report_page};
use crate::session::{
    Assignment, Batch, Content, Outputs, Replay, Replayed, Session, SessionError, SubjectRun, replay, replay_all,
};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

#[derive(clap::Args)]
pub(super) struct ReplayArgs {
    /// A recipe.toml, or the folder of a session
    recipe: PathBuf,
    /// Folder of the new session; with --subjects, of all their sessions. A replay that was interrupted there continues
    #[arg(long, value_name = "DIR")]
    into: PathBuf,
    /// Differences from the recipe: STEP=FILE for another scan, STEP.until=PLACE, STEP.STAGE.PARAMETER=VALUE, …
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// A table of people: the first column has their names, each other column is a KEY that differs between them
    #[arg(long, value_name = "FILE.csv")]
    subjects: Option<PathBuf>,
    /// Number of people at a time
    #[arg(long, value_name = "N", default_value_t = 1, requires = "subjects", value_parser = clap::value_parser!(u32).range(1..=64))]
    jobs: u32,
    /// With --subjects: replace a summary.csv, people.html or report.html that Overcoat did not write
    #[arg(long, requires = "subjects")]
    force: bool,
    /// Exit with 1 unless every step is good
    #[arg(long)]
    strict: bool,
}

pub(super) fn run(args: ReplayArgs, context: &Context) -> anyhow::Result<Done> {
    let set = args.set.iter().map(|text| Assignment::parse(text)).collect::<Result<Vec<_>, SessionError>>()?;
    match args.subjects {
        None => {
            one(Replay { recipe: args.recipe, into: args.into, set, set_from: PathBuf::new() }, args.strict, context)
        }
        Some(subjects) => many(
            Batch {
                recipe: args.recipe,
                into: args.into,
                subjects,
                set,
                set_from: PathBuf::new(),
                jobs: args.jobs as usize,
                force: args.force,
            },
            args.strict,
            context,
        ),
    }
}

fn one(request: Replay, strict: bool, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let mut progress = Progress::of_stages(&context.console, 1);
    let Replayed { reports, verdicts, left_out } = replay(&request, &mut |event| progress.show(event))?;
    progress.end();
    let ran = reports.iter().filter(|r| r.ran).count();
    let json = json!({
        "session": request.into.display().to_string(),
        "recipe": request.recipe.display().to_string(),
        "ran": ran,
        "left_out": left_out,
        "steps": verdicts,
        "stages": reports,
        "secs": began.elapsed().as_secs_f64(),
    });
    let (recipe, into) = (request.recipe.display(), request.into.display());
    let done = Done::new("replay", json)
        .lines(left_out.iter().map(|what| format!("left out {what}")))
        .line(format!(
            "replayed {recipe} into {into}: {ran} of {} stages ran, in {}",
            reports.len(),
            secs(began.elapsed())
        ))
        .next(format!("overcoat -C {into} status"))
        .next(format!("overcoat -C {into} export character.glb"));
    Ok(if strict { verdicts::required_good(done, &verdicts, context) } else { done })
}

fn many(batch: Batch, strict: bool, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let is_reported = context.console.verbosity > Verbosity::Quiet;
    let page = batch.into.join("people.html");
    if batch.into.is_dir() {
        Outputs::in_folder(&batch.into, batch.force).claim(&page, Content::Page)?;
    }
    let reported = Mutex::new(BTreeSet::new());
    let runs = replay_all(&batch, &|run| {
        if is_reported {
            print_aside(&format!("{:<16} {:>8}  {}", run.name, secs(run.took), result_of(run)));
        }
        match report_on(&batch, run) {
            Ok(true) => drop(reported.lock().unwrap_or_else(PoisonError::into_inner).insert(run.name.clone())),
            Ok(false) => {}
            Err(error) => print_aside(&format!("{}: no report: {}", run.name, failure::one_line(&error.to_string()))),
        }
    })?;
    let reported = reported.into_inner().unwrap_or_else(PoisonError::into_inner);
    // Others have written to the folder's manifest since.
    let mut outputs = Outputs::in_folder(&batch.into, batch.force);
    outputs.claim(&page, Content::Page)?;
    let html = people_page(&runs, &|name| reported.contains(name));
    outputs.write_bytes(&page, Content::Page, html.into_bytes())?;
    let failed = runs.iter().filter(|run| run.outcome.is_err()).count();
    let json = json!({
        "into": batch.into.display().to_string(),
        "recipe": batch.recipe.display().to_string(),
        "subjects": runs.iter().map(as_json).collect::<Vec<_>>(),
        "failed": failed,
        "secs": began.elapsed().as_secs_f64(),
    });
    let mut done = Done::new("replay", json).lines(table(&runs)).line(format!(
        "{} of {} people dressed in {}; all measures are in {}, a page about each in {}",
        runs.len() - failed,
        runs.len(),
        secs(began.elapsed()),
        batch.into.join("summary.csv").display(),
        page.display()
    ));
    if let Some(first) = runs.iter().find(|run| run.outcome.is_err()) {
        let what = format!(
            "{failed} of {} people could not be dressed; the first: {}: {}",
            runs.len(),
            first.name,
            reason_of(first)
        );
        done = done
            .failed(what, "correct what is reported and run the same command again: it continues with what is missing");
    }
    let doubtful: Vec<&str> = runs.iter().filter(|run| !is_good(run)).map(|run| run.name.as_str()).collect();
    if strict && done.failed.is_none() && !doubtful.is_empty() {
        let what = format!(
            "{} of {} people have steps that are not good: {}",
            doubtful.len(),
            runs.len(),
            doubtful.join(", ")
        );
        done = done.failed(what, "look at these sessions with `overcoat -C DIR status`");
    }
    Ok(done)
}

/// Writes the report on a person into their session; false if there is none to report on.
fn report_on(batch: &Batch, run: &SubjectRun) -> anyhow::Result<bool> {
    if run.outcome.is_err() {
        return Ok(false);
    }
    let session = Session::open(&batch.into.join(&run.name))?;
    let path = session.dir().join("report.html");
    let mut outputs = session.outputs(batch.force);
    outputs.claim(&path, Content::Page)?;
    outputs.write_bytes(&path, Content::Page, report_page(&session)?.into_bytes())?;
    Ok(true)
}

/// The verdicts of a person's steps: `good`, or those that are not.
fn result_of(run: &SubjectRun) -> String {
    match &run.outcome {
        Ok(replayed) => {
            let doubtful = replayed.verdicts.iter().filter(|v| !v.verdict.is_good()).map(verdicts::line);
            let left_out = replayed.left_out.iter().map(|what| format!("left out {what}"));
            let parts: Vec<String> = doubtful.chain(left_out).collect();
            if parts.is_empty() { "good".into() } else { parts.join(" | ") }
        }
        Err(sentence) => format!("failed: {sentence}"),
    }
}

fn reason_of(run: &SubjectRun) -> &str {
    run.outcome.as_ref().err().map_or("", String::as_str)
}

fn is_good(run: &SubjectRun) -> bool {
    run.outcome.as_ref().is_ok_and(|replayed| replayed.verdicts.iter().all(|v| v.verdict.is_good()))
}

/// A column of the table: its heading, the measure of any stage, and how several values are combined.
const COLUMNS: [(&str, &str, &str, Pick); 5] = [
    ("body mm", "register", "residual_mean_mm", Pick::Most),
    ("outside %", "pose", "outside_percent", Pick::Most),
    ("hems", "cut", "hem_loops", Pick::Sum),
    ("inside", "stack", "inside_after", Pick::Sum),
    ("crossing", "stack", "intersecting_pairs", Pick::Sum),
];

#[derive(Clone, Copy)]
enum Pick {
    Most,
    Sum,
}

fn table(runs: &[SubjectRun]) -> Vec<String> {
    let heads: String = COLUMNS.iter().map(|(head, ..)| format!(" {head:>10}")).collect();
    let head = format!("{:<16} {:>8}{heads}  result", "subject", "time");
    std::iter::once(head).chain(runs.iter().map(row)).collect()
}

fn row(run: &SubjectRun) -> String {
    let reports = run.outcome.as_ref().map(|r| r.reports.as_slice()).unwrap_or_default();
    let cell = |(_, stage, measure, pick): &(&str, &str, &str, Pick)| {
        let of_stage = reports.iter().filter(|r| r.stage.to_string() == *stage);
        let values: Vec<f64> = of_stage.filter_map(|r| r.measures.get(*measure).copied()).collect();
        let value = match (values.is_empty(), pick) {
            (true, _) => return format!(" {:>10}", "-"),
            (false, Pick::Most) => values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            (false, Pick::Sum) => values.iter().sum(),
        };
        if value.fract() == 0.0 { format!(" {value:>10.0}") } else { format!(" {value:>10.2}") }
    };
    let cells: String = COLUMNS.iter().map(cell).collect();
    format!("{:<16} {:>8}{cells}  {}", run.name, secs(run.took), result_of(run))
}

fn as_json(run: &SubjectRun) -> Value {
    let secs = |took: Duration| took.as_secs_f64();
    match &run.outcome {
        Ok(replayed) => json!({
            "name": run.name, "ok": true, "secs": secs(run.took),
            "ran": replayed.reports.iter().filter(|r| r.ran).count(),
            "left_out": replayed.left_out, "steps": replayed.verdicts, "stages": replayed.reports,
        }),
        Err(sentence) => json!({ "name": run.name, "ok": false, "secs": secs(run.took), "error": sentence }),
    }
}
