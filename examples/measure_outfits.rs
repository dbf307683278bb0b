//! Evaluates garments and layers on synthetic outfits of four or five layers:
//! `measure_outfits FOLDER [--kinds] [--seeds-from HASH | --first SEED] [--outfits 0..30] [--jobs 1]`.
//!
//! Every second outfit comes from simulated RGB-D frames, the others from fused meshes. Each kind of garment occurs at least
//! twice. `--seeds-from` takes the seeds from the hash of a commit, so that nobody chooses them: use it for figures that are
//! published. FOLDER keeps scans and sessions; what it has is not made again, except what depends on the program.
//!
//! Each step is one line: its verdict, labels (T8), surface (T9), hem loops found and expected, holes, distance of the hems from
//! the true ones, turning of the hems, stretch of one edge in a thousand, how much of what is below comes out in a pose; then each
//! outfit is one line: crossing pairs, vertices inside, mean move of the vertices that were clear, seconds of the last stacking.
//!
//! With `--kinds` it is ten people in each of ten pairs of garments instead, from fused meshes, and a table of how many of ten are right: no
//! crossing, and of each garment the hem loops of its template and labels of at least 0.92.

use serde_json::Value;
use std::error::Error;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// What is worn, innermost first. Written down before any of them was built with the seeds that are measured.
const OUTFITS: [&str; 30] = [
    "tshirt,jeans,pullover,jacket",
    "socks,leggings,dress,coat",
    "tanktop,shirt,trousers,vest,jacket",
    "blouse,skirt,jacket,scarf",
    "tshirt,shorts,socks,hat",
    "socks,jeans,shirt,pullover,coat",
    "leggings,tanktop,dress,vest",
    "shirt,trousers,vest,hat",
    "tshirt,shirt,jeans,pullover,scarf",
    "socks,tshirt,shorts,jacket",
    "leggings,blouse,skirt,coat,hat",
    "tanktop,tshirt,trousers,jacket,scarf",
    "socks,trousers,pullover,coat,scarf",
    "tshirt,skirt,vest,coat",
    "dress,pullover,hat,scarf",
    "tanktop,shorts,blouse,jacket",
    "leggings,tshirt,skirt,pullover",
    "socks,shirt,jeans,vest,coat",
    "blouse,trousers,pullover,jacket",
    "tanktop,leggings,shirt,coat",
    "dress,jacket,scarf,hat",
    "tshirt,jeans,vest,jacket,hat",
    "socks,blouse,shorts,vest",
    "shirt,skirt,pullover,coat",
    "tanktop,tshirt,shirt,trousers,jacket",
    "leggings,dress,coat,scarf",
    "socks,tshirt,trousers,pullover,hat",
    "shirt,jeans,jacket,coat",
    "blouse,trousers,vest,scarf",
    "tanktop,skirt,pullover,jacket",
];

/// What is difficult, and what is worn.
const KINDS: [(&str, &str); 11] = [
    ("tucked shirt", "shirt,jeans"),
    ("untucked shirt", "jeans,shirt"),
    ("open front", "tshirt,jacket"),
    ("hood", "jeans,hoodie"),
    ("overlapping hems", "leggings,socks"),
    ("cuffs over gloves", "mittens,pullover"),
    ("boots over trousers", "jeans,boots"),
    ("two-piece swimwear", "bra,briefs"),
    ("overalls", "tshirt,overalls"),
    ("thin tights", "tights,skirt"),
    (IN_ONE_COLOUR, "coat,scarf"),
];
/// The kind of which all garments have the colours of the first.
const IN_ONE_COLOUR: &str = "scarf in the colour of the coat";
/// People per kind.
const PEOPLE: usize = 10;
/// Least labels (T8) of a garment that is right.
const LEAST_IOU: f64 = 0.92;

struct Options {
    folder: PathBuf,
    seeds: Vec<u64>,
    outfits: Range<usize>,
    jobs: usize,
    kinds: bool,
}

impl Options {
    fn garments(&self, k: usize) -> &'static str {
        if self.kinds { KINDS[k / PEOPLE].1 } else { OUTFITS[k] }
    }

    /// Whether the outfit comes from frames, not from fused meshes.
    fn is_recorded(&self, k: usize) -> bool {
        !self.kinds && k % 2 == 1
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let options = options()?;
    let program = std::env::current_exe()?.with_file_name("../overcoat");
    let program = program.canonicalize().map_err(|_| "build the program first: cargo build --release")?;
    std::fs::create_dir_all(&options.folder)?;
    let folder = options.folder.canonicalize()?;
    let (next, reports) = (AtomicUsize::new(options.outfits.start), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..options.jobs {
            scope.spawn(|| {
                loop {
                    let k = next.fetch_add(1, Ordering::Relaxed);
                    if k >= options.outfits.end {
                        break;
                    }
                    let report = outfit(&program, &folder, k, &options);
                    for line in &report.lines {
                        println!("{line}");
                    }
                    reports.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(report);
                }
            });
        }
    });
    let reports = reports.into_inner()?;
    summary(&reports);
    if options.kinds {
        table_of_kinds(&reports);
    }
    Ok(())
}

fn table_of_kinds(reports: &[Report]) {
    println!("\n| kind | worn | right | all good |\n|---|---|---|---|");
    for (k, (name, worn)) in KINDS.iter().enumerate() {
        let of_kind: Vec<&Report> = reports.iter().filter(|report| report.number / PEOPLE == k).collect();
        let right = of_kind.iter().filter(|report| report.is_right()).count();
        let good = of_kind.iter().filter(|report| report.good && !report.failed).count();
        if !of_kind.is_empty() {
            println!("| {name} | {worn} | {right} of {} | {good} |", of_kind.len());
        }
    }
}

fn options() -> Result<Options, Box<dyn Error>> {
    let mut folder = None;
    let (mut first, mut hash, mut jobs, mut kinds) = (2100, None, 1, false);
    let mut outfits = 0..usize::MAX;
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut value = || args.next().ok_or(format!("{arg} needs a value"));
        match arg.as_str() {
            "--seeds-from" => hash = Some(value()?),
            "--first" => first = value()?.parse()?,
            "--jobs" => jobs = value()?.parse()?,
            "--kinds" => kinds = true,
            "--outfits" => {
                let given = value()?;
                let (from, to) = given.split_once("..").ok_or("--outfits takes FROM..TO")?;
                outfits = from.parse()?..to.parse::<usize>()?;
            }
            _ => folder = Some(PathBuf::from(arg)),
        }
    }
    let count = if kinds { KINDS.len() * PEOPLE } else { OUTFITS.len() };
    let seeds = match hash {
        Some(hash) => overcoat::studio::seeds_of(&hash, count)?,
        None => (first..).take(count).collect(),
    };
    outfits.end = outfits.end.min(count);
    Ok(Options { folder: folder.ok_or("which folder keeps the outfits?")?, seeds, outfits, jobs, kinds })
}

/// What is known of one outfit.
#[derive(Default)]
struct Report {
    number: usize,
    lines: Vec<String>,
    failed: bool,
    /// Whether every verdict is `good`.
    good: bool,
    conflicts: f64,
    stack_secs: f64,
    clear_move_mm: f64,
    garments: Vec<Garment>,
}

impl Report {
    fn is_right(&self) -> bool {
        let is_right = |garment: &Garment| garment.hems_are_right && garment.iou >= LEAST_IOU;
        !self.failed && self.conflicts == 0.0 && !self.garments.is_empty() && self.garments.iter().all(is_right)
    }
}

struct Garment {
    iou: f64,
    surface_mm: f64,
    hem_mm: Option<f64>,
    hems_are_right: bool,
    /// Of one edge in a thousand.
    stretch: Option<f64>,
    /// Vertices below that come out through it in the worst pose.
    through_percent: Option<f64>,
    is_good: bool,
}

fn outfit(program: &Path, folder: &Path, k: usize, options: &Options) -> Report {
    let mut report = Report { number: k, ..Report::default() };
    let source = if options.is_recorded(k) { "RGB-D" } else { "mesh" };
    report.lines.push(format!("outfit {k} (seed {}, {source}): {}", options.seeds[k], options.garments(k)));
    if let Err(error) = measured(program, folder, k, options, &mut report) {
        report.failed = true;
        report.lines.push(format!("  FAILED: {error}"));
    }
    report
}

fn measured(
    program: &Path,
    folder: &Path,
    k: usize,
    options: &Options,
    report: &mut Report,
) -> Result<(), Box<dyn Error>> {
    let (seed, worn, is_recorded) = (options.seeds[k], options.garments(k), options.is_recorded(k));
    let place = folder.join(format!("{k:02}-{seed}"));
    std::fs::create_dir_all(&place)?;
    let garments: Vec<&str> = worn.split(',').collect();
    if !place.join("scans/truth/joints.json").is_file() {
        let seed = seed.to_string();
        let mut make = vec!["studio", "make", "--seed", &seed, "--garments", worn, "--out", "scans", "-q"];
        make.extend(["--faces", "55000"]);
        if !is_recorded {
            make.push("--no-frames");
        }
        if options.kinds && KINDS[k / PEOPLE].0 == IN_ONE_COLOUR {
            make.push("--alike");
        }
        run(program, &place, &make)?;
    }
    let session = place.join("session");
    if !session.exists() {
        run(program, &place, &["new", "session"])?;
        let of_step = |k: usize, name: &str, recorded: bool| {
            if recorded { format!("../scans/{k}-{name}") } else { format!("../scans/{k}-{name}.ply") }
        };
        run(program, &session, &["scan", "body", &of_step(0, "body", is_recorded)])?;
        for (step, name) in (1..).zip(&garments) {
            let kind = overcoat::studio::GarmentKind::from_name(name)?.template();
            run(program, &session, &["scan", name, &of_step(step, name, is_recorded), "--template", kind])?;
        }
    }
    let began = Instant::now();
    let built = Command::new(program).args(["build", "-q"]).current_dir(&session).output()?;
    let build_secs = began.elapsed().as_secs_f64();
    if !built.status.success() {
        report.failed = true;
        let errors = String::from_utf8_lossy(&built.stderr).into_owned();
        report.lines.push(format!("  FAILED after {build_secs:.0} s: {}", sentence(&errors)));
    }
    let status: Value = serde_json::from_str(&run(program, &session, &["status", "--json"])?)?;
    let measures = run(program, &session, &["measure", "--truth", "../scans/truth", "--invented", "--json"]);
    let measures: Value = match measures {
        Ok(text) => serde_json::from_str(&text)?,
        Err(_) if report.failed => return Ok(()),
        Err(error) => return Err(error.into()),
    };
    report.good = true;
    for (step, measured) in status["steps"].as_array().into_iter().flatten().zip(steps(&measures)) {
        let verdict = step["verdict"].as_str().unwrap_or("?");
        report.good &= verdict == "good";
        let number = |name: &str| measured[name].as_f64();
        let Some(iou) = number("garment_iou") else {
            let (surface, joints) = (number("surface_mean_mm"), number("joint_mean_mm"));
            report.lines.push(format!(
                "  {:10} surface {:.1} mm, joints {:.1} mm  {verdict}",
                "body",
                surface.unwrap_or(f64::NAN),
                joints.unwrap_or(f64::NAN)
            ));
            continue;
        };
        let name = measured["name"].as_str().unwrap_or_default();
        let count = |name: &str| measured[name].as_u64().unwrap_or(0);
        let (found, expected) = (count("hem_loops"), count("hem_loops_expected"));
        let opens = matches!(name, "vest" | "jacket" | "coat");
        let hems_are_right = found == expected || (opens && (found == 1 || found + 1 == expected));
        let garment = Garment {
            iou,
            surface_mm: number("garment_surface_mean_mm").unwrap_or(f64::NAN),
            hem_mm: number("hem_to_truth_mm"),
            hems_are_right,
            stretch: number("pose_stretch_p999"),
            through_percent: number("pose_through_percent"),
            is_good: verdict == "good",
        };
        report.lines.push(format!(
            "  {name:10} IoU {iou:.3}  T9 {:.2} mm  hems {found} of {expected}, {} holes, {:.1} mm off, {:.1} deg/cm  stretch {:.2}, {:.2} % through  hidden {:.1} mm, outside {:.2} %  {verdict}",
            garment.surface_mm,
            count("holes"),
            garment.hem_mm.unwrap_or(f64::NAN),
            number("hem_roughness").unwrap_or(f64::NAN),
            garment.stretch.unwrap_or(f64::NAN),
            garment.through_percent.unwrap_or(f64::NAN),
            number("proximity_mean_mm").unwrap_or(f64::NAN),
            number("outside_truth_percent").unwrap_or(f64::NAN),
        ));
        report.garments.push(garment);
    }
    let pairs: Vec<&Value> = measures["pairs"].as_array().into_iter().flatten().collect();
    let sum = |name: &str| pairs.iter().filter_map(|pair| pair[name].as_f64()).sum::<f64>();
    report.conflicts = sum("intersecting_pairs") + sum("inside_percent");
    let state: Value = serde_json::from_slice(&std::fs::read(session.join("session.json"))?)?;
    let stacks: Vec<&Value> = steps(&state).map(|step| &step["stages"]["stack"]).filter(|s| s.is_object()).collect();
    let of_stack = |stack: &Value, name: &str| stack["measures"][name].as_f64().unwrap_or(f64::NAN);
    let timings: Value = serde_json::from_slice(&std::fs::read(session.join("timings.json"))?)?;
    let last = garments.last().copied().unwrap_or_default();
    report.stack_secs = timings[last]["stack"].as_f64().unwrap_or(f64::NAN);
    report.clear_move_mm = stacks.iter().map(|stack| of_stack(stack, "mean_move_of_clear_mm")).fold(0.0, f64::max);
    report.lines.push(format!(
        "  {} crossing pairs, {:.2} % inside, clear vertices move {:.2} mm, last stack {:.1} s, build {build_secs:.0} s",
        sum("intersecting_pairs"),
        sum("inside_percent"),
        report.clear_move_mm,
        report.stack_secs,
    ));
    Ok(())
}

fn steps(report: &Value) -> impl Iterator<Item = &Value> {
    report["steps"].as_array().into_iter().flatten()
}

fn run(program: &Path, dir: &Path, args: &[&str]) -> Result<String, String> {
    let output = Command::new(program).args(args).current_dir(dir).output().map_err(|e| e.to_string())?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    Err(format!("{}: {}", args.join(" "), sentence(&String::from_utf8_lossy(&output.stderr))))
}

fn sentence(errors: &str) -> String {
    errors.lines().find(|line| line.starts_with("error")).unwrap_or(errors).to_string()
}

fn summary(reports: &[Report]) {
    let garments: Vec<&Garment> = reports.iter().flat_map(|r| &r.garments).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let of = |f: fn(&Garment) -> f64| garments.iter().map(|g| f(g)).collect::<Vec<_>>();
    let (ious, surfaces) = (of(|g| g.iou), of(|g| g.surface_mm));
    let hems: Vec<f64> = garments.iter().filter_map(|g| g.hem_mm).collect();
    let right = garments.iter().filter(|g| g.hems_are_right).count();
    println!(
        "\n{} outfits: {} failed, {} all good; of those that did not fail {} have a crossing or a vertex inside",
        reports.len(),
        reports.iter().filter(|r| r.failed).count(),
        reports.iter().filter(|r| !r.failed && r.good).count(),
        reports.iter().filter(|r| !r.failed && r.conflicts > 0.0).count(),
    );
    println!(
        "{} garments, {} good: IoU mean {:.3}, worst {:.3}; T9 mean {:.2} mm, worst {:.2}; hem loops right {} ({:.0} %); hem to true hem mean {:.1} mm, worst {:.1}",
        garments.len(),
        garments.iter().filter(|g| g.is_good).count(),
        mean(&ious),
        ious.iter().copied().fold(f64::INFINITY, f64::min),
        mean(&surfaces),
        surfaces.iter().copied().fold(0.0, f64::max),
        right,
        100.0 * right as f64 / garments.len().max(1) as f64,
        mean(&hems),
        hems.iter().copied().fold(0.0, f64::max),
    );
    let mut stretches: Vec<f64> = garments.iter().filter_map(|g| g.stretch).collect();
    stretches.sort_by(f64::total_cmp);
    let through: Vec<f64> = garments.iter().filter_map(|g| g.through_percent).collect();
    println!(
        "stretch of one edge in a thousand: median {:.2}, worst {:.2}; of what is below comes out in the worst pose: mean {:.2} %, worst {:.2} %; greatest mean move of clear vertices {:.2} mm; slowest last stack {:.1} s",
        stretches.get(stretches.len() / 2).copied().unwrap_or(f64::NAN),
        stretches.last().copied().unwrap_or(f64::NAN),
        mean(&through),
        through.iter().copied().fold(0.0, f64::max),
        reports.iter().map(|r| r.clear_move_mm).fold(0.0, f64::max),
        reports.iter().map(|r| r.stack_secs).fold(0.0, f64::max),
    );
}
