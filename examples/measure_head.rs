//! Measures the head below hair: `measure_head [--model MODEL.npz] [--keep-hair | --drop-hair]
//! SCAN.ply=BODY.ply[=HAIR.ply] …`, with the true body and
//! hair in the frame of the scan's file, the person facing +Z.
//!
//! A line per scan, all distances in millimetres: from the true face and from the true scalp below the hair to the fitted
//! model and to the registered surface, mean (95th percentile); the area share of the scan that the fit explains; and
//! if the fit found hair, its area, its mean stand-off and, by area, intersection over union with the true hair.
//!
//! *Head*: what can be seen of the true body from the chin upward, 13 % of the stature. *Scalp*: those of its vertices over which hair lies
//! within 0.15 m along the normal or within 8 mm in any direction. *Face*: the others that face forward.

use anyhow::{Context, Result, bail};
use overcoat::body::{BodyModel, embedded_model, read_model};
use overcoat::fit::{HairTreatment, NakedParams, RegisterParams, fit_naked, register};
use overcoat::formats::{MeshKind, RawMesh, read_mesh};
use overcoat::geometry::{Point, SurfaceIndex, TriMesh, Vec3, VertexId};
use overcoat::scan::{FileFrame, ScanParams, clean};
use std::fs::File;
use std::path::Path;

/// The head from the chin upward, in shares of the stature.
const HEAD: f64 = 0.13;
/// Hair over a vertex is at most this far along its normal, metres.
const LONGEST: f64 = 0.15;
/// Hair that lies on the skin is at most this far, metres: true hair is strips that a scanner sees through.
const ON_SKIN: f64 = 0.008;

fn main() -> Result<()> {
    let (mut model, mut subjects, mut params) = (None, Vec::new(), NakedParams::default());
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--model" => model = Some(read_model(File::open(args.next().context("--model needs a file")?)?)?),
            "--keep-hair" => params.hair = HairTreatment::Keep,
            "--drop-hair" => params.hair = HairTreatment::Drop,
            flag if flag.starts_with('-') => bail!("unknown option {flag}; see the head of examples/measure_head.rs"),
            _ => subjects.push(arg),
        }
    }
    if subjects.is_empty() {
        bail!("which scans?");
    }
    let model = model.map_or_else(embedded_model, Ok)?;
    println!("{:20} {:>14} {:>14} {:>14} {:>14}", "scan", "face: model", "registered", "scalp: model", "registered");
    for subject in &subjects {
        let files: Vec<&str> = subject.split('=').collect();
        let (Some(scan), Some(body)) = (files.first(), files.get(1)) else { bail!("give SCAN.ply=BODY.ply") };
        let line = measure(&model, &params, scan, body, files.get(2).copied());
        println!("{:20} {}", name(scan), line.unwrap_or_else(|e| format!("{e:#}")));
    }
    Ok(())
}

fn measure(model: &BodyModel, params: &NakedParams, scan: &str, body: &str, hair: Option<&str>) -> Result<String> {
    let scan = clean(&read(scan)?, &ScanParams::default(), &mut |_| {})?;
    let frame = &scan.world_from_file;
    let true_body = SurfaceIndex::prepare(&placed(&read(body)?, frame)?);
    let true_hair = hair.map(|hair| Ok::<_, anyhow::Error>(SurfaceIndex::prepare(&placed(&read(hair)?, frame)?)));
    let true_hair = true_hair.transpose()?;
    let head = TrueHead::prepare(&true_body, true_hair.as_ref());
    let fitted = fit_naked(&scan, model, params, &mut |_| {})?;
    let by_model = fitted.surface.with_points(model.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose));
    let found = register(&scan, model, &fitted, &RegisterParams::default(), &mut |_| {})?;
    let registered = found.surface.with_points(model.posed(found.surface.points(), &found.skeleton, &found.pose));
    let [by_model, registered] = [by_model, registered].map(|mesh| SurfaceIndex::prepare(&mesh));
    let of = |part: &[Point], surface: &SurfaceIndex| {
        let (mean, p95) = mean_and_p95(part.iter().map(|p| 1e3 * surface.closest(p).distance).collect());
        format!("{mean:6.2} ({p95:5.1})")
    };
    let cut_out = fitted.hair.as_ref().map(|found| {
        let areas = scan.mesh.vertex_areas();
        let is_hair =
            |p: &Point| true_hair.as_ref().is_some_and(|hair| hair.closest(p).distance < true_body.closest(p).distance);
        let (mut both, mut either) = (0.0, 0.0);
        for (v, p) in scan.mesh.points().enumerate() {
            let (a, b) = (found.vertices[v], is_hair(p));
            both += if a && b { areas[v] } else { 0.0 };
            either += if a || b { areas[v] } else { 0.0 };
        }
        let (area, stand_off) = (1e4 * found.area, 1e3 * found.stand_off);
        format!(", hair {area:.0} cm², stand-off {stand_off:.1} mm, IoU {:.2}", both / either)
    });
    Ok(format!(
        "{:>14} {:>14} {:>14} {:>14}  {:.1} % explained{}",
        of(&head.face, &by_model),
        of(&head.face, &registered),
        of(&head.scalp, &by_model),
        of(&head.scalp, &registered),
        100.0 * fitted.report.explained_share,
        cut_out.unwrap_or_default(),
    ))
}

/// The true head: vertices of its face and of the scalp below hair.
struct TrueHead {
    face: Vec<Point>,
    scalp: Vec<Point>,
}

impl TrueHead {
    fn prepare(itself: &SurfaceIndex, hair: Option<&SurfaceIndex>) -> Self {
        let body = itself.mesh();
        let bounds = body.bounds().expect("a body has points");
        let chin = bounds.max.y - HEAD * bounds.extent().y;
        let normals = body.vertex_normals();
        let is_below_hair = |v: VertexId, p: &Point| {
            hair.is_some_and(|hair| {
                hair.cast_ray(p, &normals[v], LONGEST).is_some() || hair.closest(p).distance < ON_SKIN
            })
        };
        // Mouth and nose are hollow.
        let is_free = |p: &Point, way: &Vec3| itself.cast_ray(&(p + way * 1e-3), way, LONGEST).is_none();
        let is_outside = |v: VertexId, p: &Point| {
            let ahead = if normals[v].z > 0.2 { Vec3::z() } else { normals[v] };
            p.y > chin && is_free(p, &normals[v]) && is_free(p, &ahead)
        };
        let (mut face, mut scalp) = (Vec::new(), Vec::new());
        for (v, p) in body.points().enumerate().filter(|(v, p)| is_outside(*v, p)) {
            match (is_below_hair(v, p), normals[v].z > 0.2) {
                (true, _) => scalp.push(*p),
                (false, true) => face.push(*p),
                (false, false) => {}
            }
        }
        Self { face, scalp }
    }
}

fn mean_and_p95(mut values: Vec<f64>) -> (f64, f64) {
    if values.is_empty() {
        return (f64::NAN, f64::NAN);
    }
    values.sort_by(f64::total_cmp);
    (values.iter().sum::<f64>() / values.len() as f64, values[values.len() * 95 / 100])
}

fn placed(raw: &RawMesh, frame: &FileFrame) -> Result<TriMesh> {
    let points = raw.points.iter().map(|p| frame.world_from_file(&Point::from(*p))).collect();
    Ok(TriMesh::try_from_indices(points, &raw.faces)?)
}

fn read(path: &str) -> Result<RawMesh> {
    let extension = Path::new(path).extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let file = File::open(path).with_context(|| path.to_string())?;
    Ok(read_mesh(MeshKind::from_extension(&extension)?, file)?)
}

fn name(path: &str) -> String {
    let parts: Vec<_> = Path::new(path).components().rev().take(2).collect();
    parts.iter().rev().map(|c| c.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/")
}
