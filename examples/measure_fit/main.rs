//! Evaluates the fits on synthetic people: `measure_fit CACHE [--subjects N] [--seeds-from HASH | --first SEED]
//! [--parts naked,tight,loose,arms,shape,postures,bad] [--keep DIR]`.
//!
//! `--seeds-from` takes the seeds from the hash of a commit, so that nobody chooses them: use it for figures that are
//! published. Without it the seeds start at 1000. Those are spent (`docs/evaluation.md`): they only show changes.
//!
//! Each subject is scanned naked, in something close, in something wide, and naked with the arms 30° above and below the
//! A-pose and rotated to any heading. `CACHE` keeps the scans, so that a second run only fits; `--keep` writes the fitted
//! surfaces. All parameters are the defaults. Under cloth the figure is the one registered to the subject's
//! own naked scan, as in a session, and the methods are compared: the fit, Hu's Eqs. 5–6 as printed, the ablations `hybrid`,
//! `unweighted` and `unconstrained`, and two wrong figures that must score worse: the fit shrunk along its normals, and the
//! fit moved sideways. The naked fit is compared with Hu's Eq. 4 as printed.
//!
//! With `--parts shape`: the shape by the naked scan alone beside one refined from all three, also where the naked scan lacks
//! an arm or has holes.
//!
//! With `--parts bad`: unusable scans, naked and in a shirt or a coat: unexpected poses, missing parts, other people,
//! children, things held. Each must be solved as far as the scan shows it, or be refused.
//!
//! With `--parts postures`: naked people with their arms in unexpected poses, evaluated in the same way.
//!
//! All figures but the seconds (processor time) are the same in each run.

mod bad;
mod fits;
mod shape;
mod subjects;
mod table;

use anyhow::{Context, Result, bail};
use overcoat::body::HumanJoint::UpperArm;
use overcoat::body::Side::{Left, Right};
use overcoat::body::embedded_model;
use overcoat::studio::{GarmentKind, seeds_of};
use std::path::PathBuf;
use subjects::{Cache, Posture, Wanted};
use table::{Group, Table};

/// Close-fitting garments, in turn.
const TIGHT: [GarmentKind; 5] =
    [GarmentKind::Tshirt, GarmentKind::Jeans, GarmentKind::Pullover, GarmentKind::Leggings, GarmentKind::Shirt];
/// Wide garments, in turn.
const LOOSE: [GarmentKind; 5] =
    [GarmentKind::Coat, GarmentKind::Dress, GarmentKind::Skirt, GarmentKind::Jacket, GarmentKind::Blouse];
/// Wrong spread of the arms: 30° above and below the A-pose.
const SPREAD: [Posture; 2] = [
    ("arms+30", &[(UpperArm(Left), [0.0, 0.0, 30.0]), (UpperArm(Right), [0.0, 0.0, -30.0])]),
    ("arms-30", &[(UpperArm(Left), [0.0, 0.0, -30.0]), (UpperArm(Right), [0.0, 0.0, 30.0])]),
];
/// The first of the seeds without `--seeds-from`.
const FIRST_SEED: u64 = 1000;
/// The heading changes by the golden angle from one subject to the next, which covers all headings.
const HEADING_STEP_DEG: f64 = 137.507_764;

struct Options {
    cache: PathBuf,
    first: u64,
    seeds_from: Option<String>,
    subjects: u64,
    parts: Vec<String>,
    keep: Option<PathBuf>,
}

fn options() -> Result<Options> {
    let mut o = Options {
        cache: PathBuf::new(),
        first: FIRST_SEED,
        seeds_from: None,
        subjects: 20,
        parts: ["naked", "tight", "loose", "arms"].map(String::from).into(),
        keep: None,
    };
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut value = || args.next().with_context(|| format!("{arg} needs a value"));
        match arg.as_str() {
            "--first" => o.first = value()?.parse()?,
            "--seeds-from" => o.seeds_from = Some(value()?),
            "--subjects" => o.subjects = value()?.parse()?,
            "--parts" => o.parts = value()?.split(',').map(String::from).collect(),
            "--keep" => o.keep = Some(value()?.into()),
            _ if o.cache.as_os_str().is_empty() => o.cache = arg.into(),
            _ => bail!("'{arg}' is an unexpected argument"),
        }
    }
    if o.cache.as_os_str().is_empty() {
        bail!("name the folder for the scans");
    }
    Ok(o)
}

impl Options {
    fn seeds(&self) -> Result<Vec<u64>> {
        match &self.seeds_from {
            Some(hash) => Ok(seeds_of(hash, self.subjects as usize)?),
            None => Ok((self.first..).take(self.subjects as usize).collect()),
        }
    }
}

fn main() -> Result<()> {
    let o = options()?;
    let model = embedded_model()?;
    let cache = Cache::at(o.cache.clone(), &model)?;
    let judge = fits::Judge { model: &model, keep: o.keep.clone() };
    let wants = |part: &str| o.parts.iter().any(|p| p == part);
    let (mut table, mut outcomes) = (Table::default(), bad::Outcomes::default());
    for (i, seed) in (0..).zip(o.seeds()?) {
        if wants("naked") || wants("tight") || wants("loose") {
            let naked = cache.subject(&Wanted::naked(seed))?;
            let Some(figure) = judge.naked(Group::Naked, &naked, &mut table)? else { continue };
            let worn = [(Group::Tight, TIGHT, 1, "tight"), (Group::Loose, LOOSE, 2, "loose")];
            for (group, kinds, step, _) in worn.into_iter().filter(|w| wants(w.3)) {
                let kind = kinds[i as usize % kinds.len()];
                judge.dressed(group, &figure, &cache.subject(&Wanted::wearing(seed, kind, step))?, &mut table)?;
            }
        }
        for (k, spread) in SPREAD.into_iter().enumerate().filter(|_| wants("arms")) {
            let heading = (2 * i + k as u64) as f64 * HEADING_STEP_DEG;
            let turned = cache.subject(&Wanted::naked(seed).standing(spread))?.turned(heading);
            judge.naked(Group::Arms, &turned, &mut table)?;
        }
        if wants("shape") {
            let wearing = |kinds: &[GarmentKind; 5], step| Wanted::wearing(seed, kinds[i as usize % kinds.len()], step);
            let others = [cache.subject(&wearing(&TIGHT, 1))?, cache.subject(&wearing(&LOOSE, 2))?];
            judge.shapes(&cache.subject(&Wanted::naked(seed))?, others.into(), &mut table)?;
        }
        if wants("postures") {
            bad::try_postures(&cache, &model, seed, &mut outcomes)?;
        }
        if wants("bad") {
            bad::try_all(&cache, &model, seed, &mut outcomes)?;
        }
    }
    print!("\n{table}{outcomes}");
    Ok(())
}
