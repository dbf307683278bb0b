//! Runs one recipe on a table of subjects: one session per subject, several in parallel.

use super::replay::{Replay, Replayed, read_recipe, replay};
use crate::session::error::SessionError;
use crate::session::open::source;
use crate::session::pipeline::StageReport;
use crate::session::recipe::{Assignment, assignment, is_file_name, is_same_file_name};
use crate::session::results::{Content, Outputs};
use crate::session::store::check_folder;
use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// The request to run a recipe on many subjects.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    /// A recipe, or the folder of a session.
    pub recipe: PathBuf,
    /// The folder that receives one session per subject and, at the end, `summary.csv`.
    pub into: PathBuf,
    /// A table: the first column names the subject, the others are keys of [`Assignment`]; an empty cell sets nothing.
    /// Paths are relative to its folder.
    pub subjects: PathBuf,
    /// Assignments for all subjects.
    pub set: Vec<Assignment>,
    /// The folder to which paths in `set` are relative.
    pub set_from: PathBuf,
    /// Number of subjects that run in parallel.
    pub jobs: usize,
    /// Replace a `summary.csv` that was not written by a replay.
    pub force: bool,
}

/// The outcome of one subject.
#[derive(Clone, Debug)]
pub struct SubjectRun {
    /// Its name and that of its folder.
    pub name: String,
    /// The stages that ran or were up to date, or one sentence about the failure.
    pub outcome: Result<Replayed, String>,
    /// Run time.
    pub took: Duration,
}

struct TableRow {
    name: String,
    set: Vec<Assignment>,
}

/// Runs all subjects, `jobs` of them in parallel, in the order of the table. If one fails, the others still run.
///
/// **Errors** if the table is invalid; then nothing runs. **Guarantees** the same bytes for any number of jobs.
pub fn replay_all(batch: &Batch, on_done: &(dyn Fn(&SubjectRun) + Sync)) -> Result<Vec<SubjectRun>, SessionError> {
    let rows = read_rows(batch)?;
    check_folder(&batch.into)?;
    std::fs::create_dir_all(&batch.into).map_err(|e| SessionError::writing(&batch.into, e))?;
    let summary = batch.into.join("summary.csv");
    let mut outputs = Outputs::in_folder(&batch.into, batch.force);
    outputs.claim(&summary, Content::Named)?;
    let (next, runs) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    let work = || {
        while let Some((at, row)) = take(&next, &rows) {
            let run = run_one(batch, row);
            on_done(&run);
            runs.lock().unwrap_or_else(PoisonError::into_inner).insert(at, run);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..batch.jobs.clamp(1, rows.len().max(1)) {
            scope.spawn(work);
        }
    });
    let runs: Vec<SubjectRun> = runs.into_inner().unwrap_or_else(PoisonError::into_inner).into_values().collect();
    outputs.write_bytes(&summary, Content::Named, summary_csv(&runs)?.into_bytes())?;
    Ok(runs)
}

fn take<'a>(next: &AtomicUsize, rows: &'a [TableRow]) -> Option<(usize, &'a TableRow)> {
    let at = next.fetch_add(1, Ordering::Relaxed);
    rows.get(at).map(|row| (at, row))
}

fn run_one(batch: &Batch, row: &TableRow) -> SubjectRun {
    let began = Instant::now();
    let one = Replay {
        recipe: batch.recipe.clone(),
        into: batch.into.join(&row.name),
        set: row.set.clone(),
        set_from: PathBuf::new(),
    };
    // A panic in one subject must not stop the others; its session on disk is intact.
    let outcome = match catch_unwind(AssertUnwindSafe(|| replay(&one, &mut |_| {}))) {
        Ok(Ok(replayed)) => Ok(replayed),
        Ok(Err(e)) => Err(e.to_string()),
        Err(_) => Err("this is a fault of Overcoat, not of your data, please report it".into()),
    };
    SubjectRun { name: row.name.clone(), outcome, took: began.elapsed() }
}

fn read_rows(batch: &Batch) -> Result<Vec<TableRow>, SessionError> {
    let (recipe, _) = read_recipe(&batch.recipe)?;
    let path = &batch.subjects;
    let bad = |line: u64, reason: String| {
        SessionError::BadFile {
        path: path.clone(),
        line: usize::try_from(line).ok(),
        reason,
        hint: "the first line names the columns: subject, then keys as for --set (body, shirt, shirt.until, …); each other line is a subject".into(),
    }
    };
    let text = source::read(path)?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_slice());
    let of_csv = |e: csv::Error| bad(e.position().map_or(1, |p| p.line()), sentence_of(&e));
    let header = reader.headers().map_err(of_csv)?.clone();
    if let Some(separator) = [';', '\t'].into_iter().find(|&c| header.len() == 1 && header[0].contains(c)) {
        let name = if separator == ';' { "semicolons" } else { "tabs" };
        return Err(bad(1, format!("the columns are separated by {name}, not by commas")));
    }
    if header.is_empty() || header.iter().skip(1).any(str::is_empty) {
        return Err(bad(1, "a column has no name".into()));
    }
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    let mut rows: Vec<TableRow> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(of_csv)?;
        let line = record.position().map_or(1, |p| p.line());
        let name = record.get(0).unwrap_or_default().to_string();
        if !is_file_name(&name, &['-', '_', '.']) {
            return Err(bad(line, format!("'{name}' cannot be the name of a subject's folder")));
        }
        if rows.iter().any(|row| is_same_file_name(&row.name, &name)) {
            return Err(bad(line, format!("there is already a subject '{name}'")));
        }
        let cells = header.iter().zip(&record).skip(1).filter(|(_, value)| !value.is_empty());
        let own = cells.map(|(key, value)| seen_from(&folder, key, value, &recipe));
        let common = batch.set.iter().map(|a| seen_from(&batch.set_from, &a.key, &a.value, &recipe));
        let set: Vec<Assignment> = common.chain(own).collect();
        match assignment::apply(&mut recipe.clone(), &set, Path::new("")) {
            // A missing file fails only this subject.
            Ok(_) | Err(SessionError::NoSuchFile { .. } | SessionError::Reading { .. }) => {}
            Err(e) => return Err(bad(line, e.to_string())),
        }
        rows.push(TableRow { name, set });
    }
    match rows.is_empty() {
        true => Err(bad(1, "there is no subject in it".into())),
        false => Ok(rows),
    }
}

fn sentence_of(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("the line has {len} cells, the first line {expected_len}")
        }
        csv::ErrorKind::Utf8 { .. } => "it is not text".into(),
        _ => error.to_string(),
    }
}

/// The assignment with an absolute path, if its value is a path.
fn seen_from(folder: &Path, key: &str, value: &str, recipe: &crate::session::recipe::Recipe) -> Assignment {
    let is_path = key == "body_model"
        || key.ends_with(".mask")
        || key.ends_with(".scan")
        || recipe.steps.iter().any(|step| step.name == key);
    let value = match is_path && !value.is_empty() {
        true => folder.join(value).to_string_lossy().into_owned(),
        false => value.to_string(),
    };
    Assignment { key: key.into(), value }
}

/// The verdicts and all measures of all subjects, without run times: every run gives the same bytes.
fn summary_csv(runs: &[SubjectRun]) -> Result<String, SessionError> {
    let named = |report: &StageReport, measure: &str| format!("{}.{}.{measure}", report.step, report.stage);
    let mut columns = BTreeSet::new();
    for report in runs.iter().filter_map(|run| run.outcome.as_ref().ok()).flat_map(|r| &r.reports) {
        columns.extend(report.measures.keys().map(|measure| named(report, measure)));
    }
    let mut out = csv::Writer::from_writer(Vec::new());
    let failed = |e: csv::Error| SessionError::Encoding { reason: e.to_string() };
    let steps: BTreeSet<&str> = (runs.iter().filter_map(|run| run.outcome.as_ref().ok()))
        .flat_map(|replayed| replayed.verdicts.iter().map(|v| v.step.as_str()))
        .collect();
    let columns: Vec<String> = steps.iter().map(|step| format!("{step}.verdict")).chain(columns).collect();
    let head = ["subject".to_string(), "result".into()];
    out.write_record(head.iter().chain(&columns)).map_err(failed)?;
    for run in runs {
        let mut cells = vec![run.name.clone()];
        let mut measured = BTreeMap::new();
        match &run.outcome {
            Ok(replayed) => {
                let is_good = replayed.verdicts.iter().all(|v| v.verdict.is_good());
                cells.push(if is_good { "good" } else { "check" }.into());
                let verdicts = replayed.verdicts.iter();
                measured.extend(verdicts.map(|v| (format!("{}.verdict", v.step), v.verdict.to_string())));
                for report in &replayed.reports {
                    measured
                        .extend(report.measures.iter().map(|(name, value)| (named(report, name), value.to_string())));
                }
            }
            Err(sentence) => cells.push(format!("failed: {sentence}")),
        }
        cells.extend(columns.iter().map(|column| measured.remove(column).unwrap_or_default()));
        out.write_record(&cells).map_err(failed)?;
    }
    let bytes = out.into_inner().map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
    String::from_utf8(bytes).map_err(|e| SessionError::Encoding { reason: e.to_string() })
}
