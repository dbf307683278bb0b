//! Times beside the paper's Table 2: factorisation, a solve, a frame; iterations to convergence.

use crate::split_in_four::split_in_four;
use crate::synthetic::{STANDING, Tracker, places, poses, stream};
use overcoat::body::{Figure, SkinWeights};
use overcoat::drive::{FrameUpdate, RightSide, StreamKind};
use overcoat::drive::{LaplacianDriver, TransferParams, calibrate, embedded_library, still_window};
use overcoat::geometry::{Point, SurfaceIndex, TriangleShapes, simplified};
use std::time::Instant;

pub fn measure(figure: &Figure) {
    println!(
        "| vertices | update | factorised, ms | solve of three coordinates, ms | frame of ≤ 3 iterations, ms | iterations to 1 mm |"
    );
    println!("|---|---|---|---|---|---|");
    for thousands in [5, 10, 20] {
        let figure = with_vertices(figure, thousands * 1000);
        for (name, right, update) in [
            ("per joint", RightSide::PerEdge, FrameUpdate::PerJoint),
            ("per ring, as the paper", RightSide::PerVertex, FrameUpdate::PerRing),
        ] {
            row(&figure, name, right, update);
        }
    }
}

fn row(figure: &Figure, name: &str, right: RightSide, update: FrameUpdate) {
    let (poses, fps) = poses(figure, "walk", 4.0);
    let frames = stream(figure, &poses, fps, Tracker { noise: 0.0, lost: 0, size: 1.0 }, 1);
    let (wearer, at) = still_window(&frames).expect("it stands");
    let kind = StreamKind { are_joint_centres: true, ..StreamKind::default() };
    let calibration = calibrate(figure, &wearer, at, kind).expect("it stands");
    let library = embedded_library().unwrap();
    let params = TransferParams { right, update, ..TransferParams::default() };
    let mut driver = LaplacianDriver::try_new(figure, &calibration, &library, params).unwrap();
    let began = Instant::now();
    let body = overcoat::drive::LaplacianBody::prepare(figure, &calibration.attached, right, update).unwrap();
    let factorised = began.elapsed().as_secs_f64() * 1e3;
    let ms = |began: Instant, count: usize| began.elapsed().as_secs_f64() * 1e3 / count as f64;
    let moving = &poses[STANDING..];
    let began = Instant::now();
    for pose in moving {
        driver.follow(&calibration, &calibration.in_world(&places(figure, pose)));
    }
    let frame = ms(began, moving.len());
    let params = TransferParams { iterations: 10, ..params };
    let mut to_the_end = LaplacianDriver::try_new(figure, &calibration, &library, params).unwrap();
    let iterations: usize = moving
        .iter()
        .map(|pose| to_the_end.follow(&calibration, &calibration.in_world(&places(figure, pose))).solved.iterations)
        .sum();
    let bind = overcoat::body::Pose::bind(figure.skeleton.len());
    let rotations = body.rotations_in(figure, &bind);
    let rest: Vec<_> = figure.body().mesh.points().iter().map(|p| p.coords).collect();
    let began = Instant::now();
    for _ in 0..20 {
        body.solve(&wearer, &calibration.known, &rotations, &rest, 1, 0.0);
    }
    let solve = ms(began, 20);
    println!(
        "| {} | {name} | {factorised:.0} | {solve:.1} | {frame:.1} | {:.1} |",
        body.vertex_count(),
        iterations as f64 / moving.len() as f64
    );
}

/// The bare figure with another number of vertices: each triangle is split in four, and edges collapse.
fn with_vertices(figure: &Figure, count: usize) -> Figure {
    let body = figure.body();
    let fine = split_in_four(&body.mesh);
    let (mesh, _) = simplified(&fine, &Point::new(0.0, 0.9, 0.0), 2 * count, TriangleShapes::Regular);
    let index = SurfaceIndex::prepare(&body.mesh);
    let row = |p: &Point| {
        let at = index.closest(p);
        let corners = body.mesh.faces()[at.face];
        let parts: Vec<_> = (0..3).map(|k| (corners[k], at.barycentric[k])).collect();
        body.weights.blend(&parts)
    };
    let weights = SkinWeights::from_rows(mesh.points().iter().map(row));
    Figure::bare(figure.skeleton.clone(), mesh, weights)
}
