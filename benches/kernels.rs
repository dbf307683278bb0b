//! The kernels that most of the time is spent in: `just bench`. For the ratio to other programs: `just bench-peers-kernels`.

#[path = "kernels/inputs.rs"]
mod inputs;

use divan::{Bencher, black_box};
use overcoat::body::skin;
use overcoat::geometry::{SurfaceIndex, Vec3, WindingField};
use overcoat::numerics::SparseCholesky;
use overcoat::segment::min_cut;

const QUERIES: usize = 10_000;

fn main() {
    divan::main();
}

#[divan::bench]
fn closest_point_prepare(bencher: Bencher) {
    let mesh = inputs::body();
    bencher.bench(|| SurfaceIndex::prepare(black_box(&mesh)));
}

#[divan::bench]
fn closest_point_10k_queries(bencher: Bencher) {
    let mesh = inputs::body();
    let (index, queries) = (SurfaceIndex::prepare(&mesh), inputs::queries(&mesh, QUERIES));
    bencher.bench(|| queries.iter().map(|p| index.closest(black_box(p)).distance).sum::<f64>());
}

#[divan::bench]
fn winding_number_prepare(bencher: Bencher) {
    let mesh = inputs::body();
    bencher.bench(|| WindingField::prepare(black_box(&mesh)));
}

#[divan::bench]
fn winding_number_10k_queries(bencher: Bencher) {
    let mesh = inputs::body();
    let (field, queries) = (WindingField::prepare(&mesh), inputs::queries(&mesh, QUERIES));
    bencher.bench(|| queries.iter().map(|p| field.winding(black_box(p))).sum::<f64>());
}

#[divan::bench]
fn max_flow(bencher: Bencher) {
    let (unary, edges) = inputs::labels(&inputs::body());
    bencher.bench(|| min_cut(black_box(&unary), black_box(&edges)));
}

#[divan::bench(sample_count = 10)]
fn cholesky_prepare(bencher: Bencher) {
    let mesh = inputs::body();
    let system = inputs::system(&mesh);
    bencher.bench(|| SparseCholesky::prepare(mesh.vertex_count(), black_box(&system)));
}

#[divan::bench]
fn cholesky_solve_3(bencher: Bencher) {
    let mesh = inputs::body();
    let factor = SparseCholesky::prepare(mesh.vertex_count(), &inputs::system(&mesh));
    let Ok(factor) = factor else { unreachable!("the system is positive definite") };
    let right: Vec<Vec3> = mesh.points().iter().map(|p| p.coords).collect();
    bencher.bench(|| factor.solve_vectors(black_box(&right)));
}

/// All layers of a detailed figure, as `drive` poses them for each frame.
#[divan::bench(sample_count = 20)]
fn skinning_200k(bencher: Bencher) {
    let (points, weights, skeleton, pose) = inputs::skinned(200_000);
    bencher.bench(|| skin(black_box(&points), &weights, &skeleton, black_box(&pose)));
}

#[divan::bench(sample_count = 20)]
fn quadratic_program(bencher: Bencher) {
    let program = inputs::program();
    bencher.bench(|| black_box(&program).solve());
}
