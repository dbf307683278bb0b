//! Invents the demo: `make_demo_scans DIR [--seed N] [--garments tshirt,skirt] [--fast]` writes the scans
//! `0-body.ply`, `1-tshirt.ply`, … and below `truth/` what was really there.

use anyhow::{Context, Result, bail};
use overcoat::body::embedded_model;
use overcoat::formats::{PlyOptions, RawMesh, write_ply};
use overcoat::geometry::{PerVertex, TriMesh};
use overcoat::studio::{GarmentKind, InventedSession, ScannerParams, StudioParams, TruthNaming, invent, layer_pairs};
use std::fs::{File, create_dir_all};
use std::path::{Path, PathBuf};

/// Chosen by eye among ten: a woman of middle height.
const DEMO_SEED: u64 = 6;

fn main() -> Result<()> {
    let mut dir: Option<PathBuf> = None;
    let mut params = StudioParams { seed: DEMO_SEED, ..StudioParams::default() };
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut value = || args.next().with_context(|| format!("{arg} needs a value"));
        match arg.as_str() {
            "--fast" => {
                params.turntable.views = 24;
                params.scanner = ScannerParams { voxel: 0.01, faces: 20_000 };
            }
            "--seed" => params.seed = value()?.parse()?,
            "--garments" => {
                params.garments = GarmentKind::list(&value()?)?;
            }
            _ if dir.is_none() => dir = Some(arg.into()),
            _ => bail!("'{arg}' is one argument too many"),
        }
    }
    let dir = dir.context("where to? give a folder")?;
    let session = invent(&embedded_model()?, &params)?;
    for (k, step) in session.steps.iter().enumerate() {
        let names = session.steps.iter().map(|s| s.name.as_str());
        let worn: Vec<(&str, &TriMesh)> =
            names.zip(std::iter::once(&step.truth.body).chain(&step.truth.layers)).collect();
        let crossing: usize = layer_pairs(&worn).iter().map(|pair| pair.intersecting_pairs).sum();
        println!("{k}-{}: {} triangles scanned; {crossing} pairs cross in truth", step.name, step.scan.face_count());
    }
    write_session(&session, &dir)
}

fn write_session(session: &InventedSession, dir: &Path) -> Result<()> {
    let truth = dir.join("truth");
    create_dir_all(&truth)?;
    for (k, step) in session.steps.iter().enumerate() {
        write_mesh(&dir.join(format!("{k}-{}.ply", step.name)), &step.scan, Some(&step.colors))?;
        write_mesh(&truth.join(TruthNaming::step_body(k)), &step.truth.body, None)?;
        for (j, layer) in step.truth.layers.iter().enumerate() {
            write_mesh(&truth.join(TruthNaming::step_layer(k, j + 1)), layer, None)?;
        }
    }
    write_mesh(&truth.join(TruthNaming::bind_body()), &session.bind.body, None)?;
    for (j, layer) in session.bind.layers.iter().enumerate() {
        write_mesh(&truth.join(TruthNaming::bind_layer(j + 1)), layer, None)?;
    }
    let joints = serde_json::json!({
        "source": "invented by Overcoat's studio",
        "names": session.steps.iter().map(|s| &s.name).collect::<Vec<_>>(),
        "steps": session.steps.iter().map(|s| serde_json::json!({ "joints": &s.truth.joints })).collect::<Vec<_>>(),
    });
    std::fs::write(truth.join(TruthNaming::JOINTS), serde_json::to_string(&joints)?)?;
    Ok(())
}

fn write_mesh(path: &Path, mesh: &TriMesh, colors: Option<&PerVertex<[u8; 3]>>) -> Result<()> {
    let raw = RawMesh {
        points: mesh.points().iter().map(|p| [p.x, p.y, p.z]).collect(),
        faces: mesh.faces().iter().map(|f| f.map(|v| v.0)).collect(),
        colors: colors.map(|c| c.0.clone()),
        ..RawMesh::default()
    };
    let file = File::create(path).with_context(|| format!("cannot write {}", path.display()))?;
    write_ply(&raw, &PlyOptions::default(), file)?;
    Ok(())
}
