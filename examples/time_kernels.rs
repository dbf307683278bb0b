//! Times the kernels once on all cores and writes their inputs, so that another program can be timed on the same input in
//! the same run: `time_kernels FOLDER`. Prints one line per kernel: name, median milliseconds on the wall. See
//! `benches/peers/kernels.py`.

#[path = "../benches/kernels/inputs.rs"]
mod inputs;

use anyhow::{Context, Result};
use overcoat::body::skin;
use overcoat::formats::{NpyArray, write_npy};
use overcoat::geometry::{SurfaceIndex, Vec3, WindingField};
use overcoat::numerics::SparseCholesky;
use overcoat::segment::min_cut;
use rayon::prelude::*;
use std::fs::File;
use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;

const QUERIES: usize = 50_000;

/// Prints the median of seven runs, after one that warms up.
fn timed<T>(name: &str, mut run: impl FnMut() -> T) {
    black_box(run());
    let mut millis: Vec<f64> = (0..7)
        .map(|_| {
            let began = Instant::now();
            black_box(run());
            1e3 * began.elapsed().as_secs_f64()
        })
        .collect();
    millis.sort_by(f64::total_cmp);
    println!("{name} {:.3}", millis[millis.len() / 2]);
}

fn main() -> Result<()> {
    let folder: PathBuf = std::env::args().nth(1).context("name a folder for the inputs")?.into();
    let mesh = inputs::body();
    let queries = inputs::queries(&mesh, QUERIES);
    let system = inputs::system(&mesh);
    let (unary, edges) = inputs::labels(&mesh);
    let reals = |name: &str, values: Vec<f64>| -> Result<()> {
        Ok(write_npy(&NpyArray::vector(values), File::create(folder.join(name))?)?)
    };
    let counts = |name: &str, values: Vec<i32>| -> Result<()> {
        Ok(write_npy(&NpyArray::vector(values), File::create(folder.join(name))?)?)
    };
    reals("points.npy", mesh.points().iter().flat_map(|p| [p.x, p.y, p.z]).collect())?;
    counts("faces.npy", mesh.faces().iter().flat_map(|f| f.map(|v| v.0 as i32)).collect())?;
    reals("queries.npy", queries.iter().flat_map(|p| [p.x, p.y, p.z]).collect())?;
    counts("rows.npy", system.iter().map(|t| t.0 as i32).collect())?;
    counts("columns.npy", system.iter().map(|t| t.1 as i32).collect())?;
    reals("values.npy", system.iter().map(|t| t.2).collect())?;
    counts("unary.npy", unary.iter().map(|&u| u as i32).collect())?;
    counts("edges.npy", edges.iter().flat_map(|&(i, j, cost)| [i as i32, j as i32, cost as i32]).collect())?;

    let index = SurfaceIndex::prepare(&mesh);
    timed("closest_point", || queries.par_iter().map(|p| index.closest(p).distance).collect::<Vec<_>>());
    timed("closest_point_with_prepare", || {
        let index = SurfaceIndex::prepare(&mesh);
        queries.par_iter().map(|p| index.closest(p).distance).collect::<Vec<_>>()
    });
    timed("winding_number_with_prepare", || {
        let field = WindingField::prepare(&mesh);
        queries.par_iter().map(|p| field.winding(p)).collect::<Vec<_>>()
    });
    let (points, weights, skeleton, pose) = inputs::skinned(200_000);
    timed("skinning_200k", || skin(&points, &weights, &skeleton, &pose));
    timed("max_flow", || min_cut(&unary, &edges));
    timed("cholesky_prepare", || SparseCholesky::prepare(mesh.vertex_count(), &system));
    let factor = SparseCholesky::prepare(mesh.vertex_count(), &system)?;
    let right: Vec<Vec3> = mesh.points().iter().map(|p| p.coords).collect();
    timed("cholesky_solve_3", || factor.solve_vectors(&right));
    let program = inputs::program();
    timed("quadratic_program", || program.solve());
    Ok(())
}
