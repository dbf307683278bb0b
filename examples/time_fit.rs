//! Times the fit of a body model to a naked scan: `time_fit SCAN.ply [--model MODEL.npz] [--repeat N] [-o FITTED.ply]`.
//!
//! The scan is used without cleaning, in metres and upright. The time covers the whole fit: headings, arms, shape, pose and
//! acceptance, but not reading files. The median of the repetitions is printed. `FITTED.ply` is the model's surface by shape
//! and pose alone, vertex by vertex.

use anyhow::{Context, Result, bail};
use overcoat::body::{embedded_model, read_model};
use overcoat::fit::{NakedParams, fit_naked};
use overcoat::formats::{PlyOptions, RawMesh, read_ply, write_ply};
use overcoat::geometry::{Point, TriMesh};
use overcoat::scan::Scan;
use std::fs::File;
use std::io::{BufReader, BufWriter};
use std::time::Instant;

#[path = "shared/processor.rs"]
mod processor;
use processor::processor_secs;

fn main() -> Result<()> {
    let (mut scan, mut model, mut out, mut repeat) = (None, None, None, 1usize);
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut value = || args.next().with_context(|| format!("{arg} needs a value"));
        match arg.as_str() {
            "--model" => model = Some(value()?),
            "--repeat" => repeat = value()?.parse::<usize>()?.max(1),
            "-o" => out = Some(value()?),
            _ if scan.is_none() => scan = Some(arg),
            _ => bail!("'{arg}' is one argument too many"),
        }
    }
    let scan = scan.context("which scan?")?;
    let model = match model {
        Some(path) => read_model(BufReader::new(File::open(&path).with_context(|| path.clone())?))?,
        None => embedded_model()?,
    };
    let raw = read_ply(BufReader::new(File::open(&scan).with_context(|| scan.clone())?))?;
    let mesh = TriMesh::try_from_indices(raw.points.into_iter().map(Point::from).collect(), &raw.faces)?;
    let scan = Scan::from_clean_mesh(mesh, None);

    let (mut walls, mut processors, mut found) = (Vec::new(), Vec::new(), None);
    for _ in 0..repeat {
        let (began, busy) = (Instant::now(), processor_secs());
        found = Some(fit_naked(&scan, &model, &NakedParams::default(), &mut |_| {})?);
        walls.push(began.elapsed().as_secs_f64());
        processors.push(processor_secs() - busy);
    }
    let Some(fitted) = found else { bail!("nothing was fitted") };
    println!(
        "model of {} vertices, scan of {}: {:.3} s, {:.3} s of processor time, {} iterations, converged {}, residual {:.2} mm",
        model.template.vertex_count(),
        scan.mesh.vertex_count(),
        median(walls),
        median(processors),
        fitted.report.iterations,
        fitted.report.converged,
        1e3 * fitted.report.residual_mean,
    );
    if let Some(out) = out {
        let posed = model.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose);
        let mesh = RawMesh {
            points: posed.iter().map(|p| [p.x, p.y, p.z]).collect(),
            faces: model.template.faces().iter().map(|f| f.map(|v| v.0)).collect(),
            ..RawMesh::default()
        };
        let file = BufWriter::new(File::create(&out).with_context(|| out.clone())?);
        write_ply(&mesh, &PlyOptions::default(), file)?;
    }
    Ok(())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
