//! The body under clothes without a bare scan: the gaps between skin and cloth, and what the fit makes of them.
//!
//! `contact FOLDER SEED…` prints `templates/contact.toml`; `fit FOLDER SEED… [SCAN:BODY:LAYERS:KINDS…]` the table of
//! `docs/evaluation.md`. FOLDER keeps the synthetic people. Scans of one person are joined by `+`; the first is compared. Flags: `--no-contact`
//! without the gaps of cloth, `--known-body` with the measures of the true body as of a scan of another day, `--mean-body` without a shape, `--weak-prior` with a prior of nine times its variance, so that correlations
//! of girths hardly count.

mod subjects;

use anyhow::{Result, bail};
use overcoat::body::{BodyMeasure, BodyModel, body_measures, embedded_model};
use overcoat::fit::{
    Contact, DressedScan, EstimatedBody, HALF_INTERVAL_90, KnownMeasure, NakedParams, RegisterParams, fit_estimated,
    fit_naked, register, stand_off, zones,
};
use overcoat::geometry::{SurfaceIndex, TriMesh, Vec3};
use overcoat::measure::hidden_body;
use overcoat::scan::Scan;
use overcoat::segment::{Extent, GarmentTemplate, contacts, outermost};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;
use subjects::{Dressed, foreign, synthetic};

fn main() -> Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [command, folder, rest @ ..] = &args[..] else { bail!("measure_estimated contact|fit FOLDER SEED…") };
    let model = embedded_model()?;
    let (flags, people): (Vec<&String>, Vec<&String>) = rest.iter().partition(|arg| arg.starts_with("--"));
    let folder = PathBuf::from(folder);
    let of = |text: &String| person(&folder, &model, text);
    match command.as_str() {
        "contact" => contact_table(&people.into_iter().map(of).collect::<Result<Vec<_>>>()?, &model),
        "fit" => {
            let scans = |text: &String| text.split('+').map(|one| person(&folder, &model, one)).collect();
            fit_table(people.into_iter().map(scans), &model, &flags)
        }
        other => bail!("'{other}' is neither contact nor fit"),
    }
}

fn person(folder: &Path, model: &BodyModel, text: &str) -> Result<Dressed> {
    match text.parse() {
        Ok(seed) => synthetic(folder, model, seed),
        Err(_) => foreign(text),
    }
}

fn templates(kinds: &[String]) -> Result<Vec<(GarmentTemplate, Extent)>> {
    kinds.iter().map(|kind| Ok((GarmentTemplate::built_in(kind)?, Extent::default()))).collect()
}

/// The gaps of each kind, zone by zone: median and robust deviation, millimetres.
fn contact_table(people: &[Dressed], model: &BodyModel) -> Result<()> {
    let zones = zones(model);
    let mut gaps: BTreeMap<(String, String), Vec<f64>> = BTreeMap::new();
    for person in people {
        let kinds = templates(&person.kinds)?;
        let over = outermost(&kinds, model)?;
        let off = stand_off(&person.scan, &person.body);
        for v in model.template.vertex_ids() {
            if let (Some(kind), Some(gap)) = (over[v], off[v]) {
                gaps.entry((kinds[kind].0.name.clone(), zones[v].clone())).or_default().push(gap);
            }
        }
    }
    let mut last = String::new();
    for ((kind, zone), mut gaps) in gaps {
        gaps.sort_by(f64::total_cmp);
        let at = |share: f64| 1e3 * gaps[((gaps.len() - 1) as f64 * share) as usize];
        if kind != last {
            println!("\n[{kind}]");
            last = kind;
        }
        if gaps.len() >= 20 {
            println!("\"{zone}\" = [{:.1}, {:.1}]", at(0.5), (0.5 * (at(0.84) - at(0.16))).max(1.0));
        }
    }
    Ok(())
}

fn fit_table(people: impl Iterator<Item = Result<Vec<Dressed>>>, model: &BodyModel, flags: &[&String]) -> Result<()> {
    let has = |flag: &str| flags.iter().any(|f| *f == flag);
    let scale = match (has("--mean-body"), has("--weak-prior")) {
        (true, _) => 1e-3,
        (_, true) => 3.0,
        _ => 1.0,
    };
    let model = &scaled(model, scale);
    println!(
        "person | kinds | hidden mm | bias mm | all mm | outside % | girths in 90 % | chest, waist, hip cm (true) | s"
    );
    let (mut inside, mut count, mut hidden, mut signed) = (0, 0, Vec::new(), Vec::new());
    for person in people {
        let scans = person?;
        let gap = |c: Contact| if has("--no-contact") { Contact { gap: 0.0, deviation: 10.0 } } else { c };
        let of_scan = |person: &Dressed| {
            let contact = contacts(&templates(&person.kinds)?, model)?;
            Ok(contact.iter().map(|c| c.map(gap)).collect())
        };
        let contacts: Vec<_> = scans.iter().map(of_scan).collect::<Result<_>>()?;
        let dressed: Vec<DressedScan> =
            scans.iter().zip(contacts).map(|(person, contact)| DressedScan { scan: &person.scan, contact }).collect();
        let person = &scans[0];
        let truth = person.bind.clone().or_else(|| registered(&person.body, model));
        let truth = truth.map(|bind| body_measures(&bind, &model.weights, &model.skeleton_inside(bind.points())));
        let known: Vec<KnownMeasure> = match &truth {
            Some(truth) if has("--known-body") => truth.iter().map(known_measure).collect(),
            _ => Vec::new(),
        };
        let began = Instant::now();
        let found = match fit_estimated(&dressed, model, &known, &NakedParams::default(), &mut |_| {}) {
            Ok(found) => found,
            Err(e) => {
                println!("{} | {} | refused: {e}", person.name, person.kinds.join(" "));
                continue;
            }
        };
        let secs = began.elapsed().as_secs_f64();
        let EstimatedBody { fitted, measures, .. } = &found;
        let posed = fitted.surface.with_points(model.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose));
        let worn = hidden_body(&posed, &person.body, &person.layers);
        let bias = bias_mm(&posed, person);
        let all = vertex_mean_mm(&posed, &person.body);
        let mut words = Vec::new();
        let mut hits = (0, 0);
        if let Some(truth) = truth {
            for m in measures {
                let Some(t) = truth.iter().find(|t| t.name == m.name) else { continue };
                if m.name.contains("girth") && m.name != "head girth" {
                    hits.1 += 1;
                    hits.0 += i32::from((t.metres - m.metres).abs() < HALF_INTERVAL_90 * m.deviation);
                }
                if ["stature", "chest girth", "waist girth", "hip girth"].contains(&m.name.as_str()) {
                    let half = 100.0 * HALF_INTERVAL_90 * m.deviation;
                    words.push(format!("{:.1}±{half:.1} ({:.1})", 100.0 * m.metres, 100.0 * t.metres));
                }
            }
        }
        (inside, count) = (inside + hits.0, count + hits.1);
        hidden.push(worn.proximity_mean_mm);
        signed.push(bias);
        println!(
            "{} | {} | {:.1} | {bias:+.1} | {} | {:.1} | {}/{} | {} | {secs:.1}",
            person.name.rsplit('/').take(2).collect::<Vec<_>>().join(" "),
            person.kinds.join(" "),
            worn.proximity_mean_mm,
            all.map_or("-".into(), |mm| format!("{mm:.1}")),
            worn.outside_truth_percent,
            hits.0,
            hits.1,
            words.join(", "),
        );
    }
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len().max(1) as f64;
    println!("mean: hidden {:.1} mm, bias {:+.1} mm, girths {inside}/{count}", mean(&hidden), mean(&signed));
    Ok(())
}

/// A true body of another topology with the vertices of the model, in its bind pose.
fn registered(body: &TriMesh, model: &BodyModel) -> Option<TriMesh> {
    let scan = Scan::from_clean_mesh(body.clone(), None);
    let fitted = fit_naked(&scan, model, &NakedParams::default(), &mut |_| {}).ok()?;
    Some(register(&scan, model, &fitted, &RegisterParams::default(), &mut |_| {}).ok()?.surface)
}

/// With the error of a tape.
fn known_measure(m: &BodyMeasure) -> KnownMeasure {
    let deviation = if m.name == "stature" { 0.01 } else { 0.015 };
    KnownMeasure { name: m.name.clone(), value: m.metres, deviation }
}

/// The model with all components longer or shorter than they are.
fn scaled(model: &BodyModel, by: f64) -> BodyModel {
    let mut model = model.clone();
    model.shape_dirs.iter_mut().flat_map(|dirs| &mut dirs.0).for_each(|dir| *dir *= by);
    model.joint_dirs.iter_mut().flatten().for_each(|dir| *dir *= by);
    model
}

/// How far the result is outside the true skin below cloth, on average; negative inside.
fn bias_mm(result: &TriMesh, person: &Dressed) -> f64 {
    let index = SurfaceIndex::prepare(result);
    let layers: Vec<SurfaceIndex> = person.layers.iter().map(SurfaceIndex::prepare).collect();
    let normals = person.body.vertex_normals();
    let areas = person.body.vertex_areas();
    let (mut sum, mut total) = (0.0, 0.0);
    for v in person.body.vertex_ids() {
        let (p, n): (_, Vec3) = (person.body.points()[v], normals[v]);
        if !layers.iter().any(|layer| layer.cast_ray(&(p + n * 1e-5), &n, 0.12).is_some()) {
            continue;
        }
        let at = index.closest(&p);
        sum += areas[v] * (at.point - p).dot(&n);
        total += areas[v];
    }
    1e3 * sum / f64::max(total, 1e-12)
}

/// Mean distance of corresponding vertices, without those of the head, if both have the same vertices.
fn vertex_mean_mm(a: &TriMesh, b: &TriMesh) -> Option<f64> {
    (a.vertex_count() == b.vertex_count()).then(|| {
        let far: Vec<f64> = a.points().iter().zip(b.points().iter()).map(|(p, q)| (p - q).norm()).collect();
        1e3 * far.iter().sum::<f64>() / far.len() as f64
    })
}
