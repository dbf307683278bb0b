//! How much the results depend on the parameters: halves and doubles each number that the fits, the segmentation and the
//! cut are run with, on synthetic subjects, and lists those that break a goal.
//!
//! ```sh
//! just sensitivity            # 3 subjects; about an hour on 2 cores
//! just sensitivity --quick    # one subject with coarse scans; about five minutes
//! just sensitivity --only pose.margin,segment.color
//! ```
//!
//! The numbers are those that a build records in `session.json`, so a new parameter is varied without a change here. A
//! share above one half is varied by its distance from 1. A variation is a line in the recipe, as a person would write it.

#[path = "shared/goals.rs"]
mod goals;

use goals::{GOALS, exceeded};
use serde_json::Value;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The stages whose parameters are varied: as `session.json` names them, and as the recipe does.
const STAGES: [(&str, &str); 5] =
    [("fit", "fit"), ("register", "register"), ("pose", "pose"), ("evidence", "segment"), ("cut", "cut")];
/// Of these stages only some parameters are varied; of all others, each number.
const OF_CUT: [&str; 1] = ["smoothing_radius"];
/// Seed and garments of each subject. Below 1000, so that no held-out subject is spent.
const SUBJECTS: [(&str, &str); 3] =
    [("21", "tshirt,jeans,jacket"), ("22", "blouse,skirt,coat"), ("25", "leggings,shirt,vest")];
const QUICK: [(&str, &str); 1] = [("21", "tshirt,jeans")];

/// One number of one stage.
#[derive(Clone, PartialEq)]
struct Parameter {
    section: &'static str,
    name: String,
    value: Value,
}

/// A parameter with another value.
struct Variation {
    parameter: Parameter,
    is_doubled: bool,
    value: toml::Value,
}

struct Subject {
    name: String,
    /// Holds `session`, built with the defaults, and `scans` with their truth.
    dir: PathBuf,
    /// What the defaults miss.
    missed: Vec<String>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let is_quick = args.iter().any(|arg| arg == "--quick");
    let only = args.iter().position(|arg| arg == "--only").and_then(|at| args.get(at + 1));
    let program = std::env::current_exe()?.with_file_name("../overcoat");
    let program = program.canonicalize().map_err(|_| "build the program first: cargo build --release")?;
    let dir = tempfile::tempdir()?;
    let list: &[(&str, &str)] = if is_quick { &QUICK } else { &SUBJECTS };
    let mut subjects = Vec::new();
    for (seed, garments) in list {
        subjects.push(subject(&program, dir.path(), seed, garments, is_quick)?);
    }
    let mut parameters = parameters(&subjects[0].dir.join("session"))?;
    if let Some(only) = only {
        parameters.retain(|p| only.split(',').any(|name| name == format!("{}.{}", p.section, p.name)));
    }
    let variations: Vec<Variation> = parameters.iter().flat_map(varied).collect();
    println!("{} parameters, {} variations, {} subjects", parameters.len(), variations.len(), subjects.len());

    let jobs: Vec<(&Variation, &Subject)> =
        variations.iter().flat_map(|v| subjects.iter().map(move |s| (v, s))).collect();
    let (next, found) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for worker in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            let (next, found, jobs, program) = (&next, &found, &jobs, &program);
            scope.spawn(move || {
                while let Some((variation, subject)) = jobs.get(next.fetch_add(1, Ordering::Relaxed)) {
                    // Beside the session, as the recipe names the scans relative to its folder.
                    let place = subject.dir.join(format!("worker-{worker}"));
                    let broken = broken_by(program, &place, variation, subject);
                    if !broken.is_empty() {
                        eprintln!("{} on {}: {}", shown(variation), subject.name, broken.join("; "));
                    }
                    found.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((shown(variation), broken));
                }
            });
        }
    });

    let found = found.into_inner()?;
    println!("\nparameters that break a goal when halved or doubled:");
    let mut count = 0;
    for variation in &variations {
        let name = shown(variation);
        let mut broken: Vec<&String> =
            found.iter().filter(|(n, _)| *n == name).flat_map(|(_, broken)| broken).collect();
        broken.sort();
        if !broken.is_empty() {
            count += 1;
            let list: Vec<&str> = broken.iter().map(|line| line.as_str()).collect();
            println!("  {name}: {}", list.join("; "));
        }
    }
    println!("{count} of {} variations break a goal that the defaults meet", variations.len());
    Ok(())
}

/// Runs the program on one thread: as many variations run at a time as there are cores.
fn overcoat(program: &Path, dir: &Path, args: &[&str]) -> Result<String, String> {
    let output = Command::new(program).args(args).env("RAYON_NUM_THREADS", "1").current_dir(dir).output();
    let output = output.map_err(|e| e.to_string())?;
    let error = String::from_utf8_lossy(&output.stderr);
    let sentence = || error.lines().find(|line| line.starts_with("error")).unwrap_or(&error).to_string();
    if output.status.success() { Ok(String::from_utf8_lossy(&output.stdout).into_owned()) } else { Err(sentence()) }
}

/// Makes the scans of a synthetic person and builds their session.
fn subject(program: &Path, dir: &Path, seed: &str, garments: &str, is_quick: bool) -> Result<Subject, Box<dyn Error>> {
    let place = dir.join(seed);
    std::fs::create_dir_all(&place)?;
    let (faces, views) = if is_quick { ("20000", "24") } else { ("40000", "36") };
    let make = ["studio", "make", "--seed", seed, "--garments", garments, "--no-frames", "--out", "scans", "-q"];
    overcoat(program, &place, &[&make[..], &["--faces", faces, "--views", views]].concat())?;
    overcoat(program, &place, &["new", "session"])?;
    let session = place.join("session");
    overcoat(program, &session, &["scan", "body", "../scans/0-body.ply"])?;
    for (k, name) in (1..).zip(garments.split(',')) {
        let kind = if name == "jeans" { "trousers" } else { name };
        overcoat(program, &session, &["scan", name, &format!("../scans/{k}-{name}.ply"), "--template", kind])?;
    }
    overcoat(program, &session, &["build", "-q"])?;
    let missed = missed(program, &session, &place.join("scans/truth"))?;
    println!("seed {seed} ({garments}): the defaults miss {} goals {missed:?}", missed.len());
    Ok(Subject { name: format!("seed {seed}"), dir: place, missed })
}

/// The goals that a built session misses.
fn missed(program: &Path, session: &Path, truth: &Path) -> Result<Vec<String>, Box<dyn Error>> {
    let truth = truth.to_str().ok_or("the folder's name is not Unicode")?;
    let report = overcoat(program, session, &["measure", "--truth", truth, "--invented", "--json"])?;
    Ok(exceeded(&serde_json::from_str(&report)?, GOALS.iter()))
}

/// Every number with which the stages of a built session ran.
fn parameters(session: &Path) -> Result<Vec<Parameter>, Box<dyn Error>> {
    let state: Value = serde_json::from_slice(&std::fs::read(session.join("session.json"))?)?;
    let steps = state["steps"].as_array().ok_or("session.json has no steps")?;
    let mut found: Vec<Parameter> = Vec::new();
    for (stage, section) in STAGES {
        let record =
            steps.iter().map(|step| &step["stages"][stage]["from"]["params"]).find(|params| params.is_object());
        let record = record.and_then(Value::as_object).ok_or_else(|| format!("no step has a stage '{stage}'"))?;
        let is_number = |v: &Value| v.is_number() || v.as_array().is_some_and(|list| list.iter().all(Value::is_number));
        let is_meant = |name: &str| section != "cut" || OF_CUT.contains(&name);
        let numbers = record.iter().filter(|(name, value)| is_number(value) && is_meant(name));
        found.extend(numbers.map(|(name, value)| Parameter { section, name: name.clone(), value: value.clone() }));
    }
    Ok(found)
}

/// The parameter halved, and doubled.
fn varied(parameter: &Parameter) -> Vec<Variation> {
    let number = |value: &Value, factor: f64| match (value.as_i64(), value.as_f64()) {
        (Some(count), _) => toml::Value::Integer(((count as f64 * factor).round() as i64).max(1)),
        (None, Some(share)) if share > 0.5 && share < 1.0 => toml::Value::Float(1.0 - (1.0 - share) / factor),
        (None, real) => toml::Value::Float(real.unwrap_or(f64::NAN) * factor),
    };
    let times = |factor| match &parameter.value {
        Value::Array(list) => toml::Value::Array(list.iter().map(|value| number(value, factor)).collect()),
        value => number(value, factor),
    };
    [(false, 0.5), (true, 2.0)]
        .map(|(is_doubled, factor)| Variation { parameter: parameter.clone(), is_doubled, value: times(factor) })
        .into_iter()
        .collect()
}

fn shown(Variation { parameter, is_doubled, value }: &Variation) -> String {
    let how = if *is_doubled { "doubled" } else { "halved" };
    format!("{}.{} {how} ({} -> {value})", parameter.section, parameter.name, parameter.value)
}

/// The goals that a variation breaks on a subject, or why it does not build.
fn broken_by(program: &Path, place: &Path, variation: &Variation, subject: &Subject) -> Vec<String> {
    let tried = || -> Result<Vec<String>, Box<dyn Error>> {
        if place.exists() {
            std::fs::remove_dir_all(place)?;
        }
        copy_folder(&subject.dir.join("session"), place)?;
        let mut recipe: toml::Table = std::fs::read_to_string(place.join("recipe.toml"))?.parse()?;
        let of_body = matches!(variation.parameter.section, "fit" | "register");
        let steps = recipe.get_mut("step").and_then(toml::Value::as_array_mut).ok_or("the recipe has no steps")?;
        for (k, step) in steps.iter_mut().enumerate().filter(|(k, _)| of_body == (*k == 0)) {
            let step = step.as_table_mut().ok_or_else(|| format!("step {k} is no table"))?;
            // The recipe names files as seen from the session's folder.
            let section = step.entry(variation.parameter.section).or_insert_with(|| toml::Table::new().into());
            let section = section.as_table_mut().ok_or("a stage is no table")?;
            section.insert(variation.parameter.name.clone(), variation.value.clone());
        }
        std::fs::write(place.join("recipe.toml"), toml::to_string(&recipe)?)?;
        overcoat(program, place, &["build", "-q"])?;
        missed(program, place, &subject.dir.join("scans/truth"))
    };
    let row = |line: &String| line.split(':').next().unwrap_or_default().to_string();
    let known: Vec<String> = subject.missed.iter().map(row).collect();
    match tried() {
        Ok(missed) => missed.into_iter().filter(|line| !known.contains(&row(line))).collect(),
        Err(error) => vec![format!("does not build: {error}")],
    }
}

fn copy_folder(from: &Path, to: &Path) -> std::io::Result<()> {
    std::fs::create_dir_all(to)?;
    for entry in std::fs::read_dir(from)? {
        let path = entry?.path();
        let target = to.join(path.file_name().unwrap_or_default());
        if path.is_dir() { copy_folder(&path, &target)? } else { std::fs::copy(&path, target).map(drop)? }
    }
    Ok(())
}
