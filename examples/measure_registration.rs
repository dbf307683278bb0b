//! Registers the body model to bare bodies and looks at what came out: `measure_registration [--model MODEL.npz]
//! BODY.ply | BODY.ply=TRUTH.ply | BODIES.npz …`. An `.npz` holds `vertices (N,V,3)` and `faces (F,3)`.
//!
//! A line a body: distance of the registered surface to the truth (the body itself, where no other is named), faces
//! turned over, pairs of triangles that cross in the fit, in the registered surface and in the scan, and the processor
//! time of the registration in seconds, of all threads together.

use anyhow::{Context, Result, bail};
use overcoat::body::{BodyModel, embedded_model, read_model};
use overcoat::fit::{NakedParams, RegisterParams, fit_naked, register};
use overcoat::formats::{MeshKind, RawMesh, read_mesh, read_npz};
use overcoat::geometry::{Point, SurfaceIndex, TriMesh, self_intersecting_pairs};
use overcoat::scan::{ScanParams, clean};
use std::fs::File;
use std::path::Path;

#[path = "shared/processor.rs"]
mod processor;
use processor::processor_secs;

fn main() -> Result<()> {
    let (mut model, mut bodies) = (None, Vec::new());
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--model" => model = Some(read_model(File::open(args.next().context("--model needs a file")?)?)?),
            _ if arg.ends_with(".npz") => bodies.extend(read_stack(Path::new(&arg))?),
            _ => bodies.push(read_pair(&arg)?),
        }
    }
    if bodies.is_empty() {
        bail!("which bodies?");
    }
    let model = model.map_or_else(embedded_model, Ok)?;
    println!(
        "{:24} {:>8} {:>8} {:>7} {:>22} {:>6}",
        "body", "mean mm", "95 % mm", "turned", "cross: fit, reg., scan", "secs"
    );
    let mut all = Vec::new();
    for (name, scan, truth) in &bodies {
        let found = measure(&model, scan, truth).with_context(|| name.clone())?;
        println!("{name:24} {found}");
        all.push(found);
    }
    let count = all.len() as f64;
    let mean = |of: fn(&Found) -> f64| all.iter().map(of).sum::<f64>() / count;
    println!(
        "{} bodies: {:.2} mm to the truth, {} faces turned over, {} pairs cross ({} in the fits), {:.2} s each",
        all.len(),
        mean(|f| f.mean_mm),
        all.iter().map(|f| f.turned).sum::<usize>(),
        all.iter().map(|f| f.crossing[1]).sum::<usize>(),
        all.iter().map(|f| f.crossing[0]).sum::<usize>(),
        mean(|f| f.secs),
    );
    Ok(())
}

struct Found {
    mean_mm: f64,
    p95_mm: f64,
    turned: usize,
    /// In the fit, the registered surface, the scan.
    crossing: [usize; 3],
    secs: f64,
}

impl std::fmt::Display for Found {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [fit, registered, scan] = self.crossing;
        let crossing = format!("{fit}, {registered}, {scan}");
        write!(f, "{:8.2} {:8.2} {:7} {crossing:>22} {:6.2}", self.mean_mm, self.p95_mm, self.turned, self.secs)
    }
}

fn measure(model: &BodyModel, raw: &RawMesh, truth: &RawMesh) -> Result<Found> {
    let scan = clean(raw, &ScanParams::default(), &mut |_| {})?;
    let fitted = fit_naked(&scan, model, &NakedParams::default(), &mut |_| {})?;
    let start = model.template.with_points(model.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose));
    let began = processor_secs();
    let found = register(&scan, model, &fitted, &RegisterParams::default(), &mut |_| {})?;
    let secs = processor_secs() - began;
    let registered = found.surface.with_points(model.posed(found.surface.points(), &found.skeleton, &found.pose));
    let turned = start.face_ids().filter(|&f| start.area_vector(f).dot(&registered.area_vector(f)) < 0.0).count();
    let true_points = truth.points.iter().map(|p| scan.world_from_file.world_from_file(&Point::from(*p))).collect();
    let truth = TriMesh::try_from_indices(true_points, &truth.faces)?;
    let index = SurfaceIndex::prepare(&truth);
    let mut off: Vec<f64> = registered.points().iter().map(|p| 1e3 * index.closest(p).distance).collect();
    off.sort_by(f64::total_cmp);
    Ok(Found {
        mean_mm: off.iter().sum::<f64>() / off.len() as f64,
        p95_mm: off[off.len() * 95 / 100],
        turned,
        crossing: [&start, &registered, &scan.mesh].map(|mesh| self_intersecting_pairs(mesh).len()),
        secs,
    })
}

type Body = (String, RawMesh, RawMesh);

fn read_pair(arg: &str) -> Result<Body> {
    let read = |path: &str| -> Result<RawMesh> {
        let extension = Path::new(path).extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let bytes = std::fs::read(path).with_context(|| path.to_string())?;
        Ok(read_mesh(MeshKind::from_extension(&extension)?, std::io::Cursor::new(bytes))?)
    };
    let (scan, truth) = arg.split_once('=').unwrap_or((arg, arg));
    let parts: Vec<_> = Path::new(scan).components().rev().take(2).collect();
    let name = parts.iter().rev().map(|c| c.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/");
    Ok((name, read(scan)?, read(truth)?))
}

fn read_stack(path: &Path) -> Result<Vec<Body>> {
    let npz = read_npz(File::open(path)?)?;
    let [count, vertices, _] = npz.shape_of::<3>("vertices")?;
    let (faces, values) = (npz.u32_rows::<3>("faces")?, npz.f64("vertices")?);
    let body = |b: usize| {
        let points = values[b * vertices * 3..(b + 1) * vertices * 3].as_chunks::<3>().0.to_vec();
        let mesh = RawMesh { points, faces: faces.clone(), ..RawMesh::default() };
        (format!("body {b}"), mesh.clone(), mesh)
    };
    Ok((0..count).map(body).collect())
}
