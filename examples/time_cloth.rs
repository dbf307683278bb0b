//! Times cloth beside other programs: `time_cloth BODY.ply GARMENT.ply PINNED [--draft]`. The body turns about the vertical by 0.35
//! rad one way and the other, once a second, as in Blender's run; the first PINNED vertices of the garment follow it. Prints
//! milliseconds a frame, on the wall and of all processors, and stretch.

#[path = "shared/processor.rs"]
mod processor;

use anyhow::{Context, Result};
use nalgebra::UnitQuaternion;
use overcoat::body::{Figure, JointId, Layer, Pose, Skeleton, SkinWeights, Skinning};
use overcoat::cloth::{ClothFrame, ClothMode, ClothParams, ClothSolver, simulate};
use overcoat::formats::read_ply;
use overcoat::geometry::{Point, TriMesh, Vec3};
use overcoat::motion::PoseTrack;
use processor::processor_secs;
use std::fs::File;
use std::io::BufReader;
use std::time::Instant;

/// Times at which the body is turned, in frames of a thirtieth of a second, and by how much, in radians.
const TURNS: [(f64, f64); 4] = [(0.0, 0.0), (7.0, 0.35), (19.0, -0.35), (29.0, 0.35)];

fn main() -> Result<()> {
    let mut args = std::env::args().skip(1);
    let mut next = || args.next().context("time_cloth BODY.ply GARMENT.ply PINNED [--draft]");
    let (body, garment, pinned): (String, String, usize) = (next()?, next()?, next()?.parse()?);
    let solver = match next() {
        Ok(word) if word == "--draft" => ClothSolver::Draft,
        _ => ClothSolver::Constraints,
    };
    let mesh = |path: &str| -> Result<TriMesh> {
        let raw = read_ply(BufReader::new(File::open(path)?))?;
        Ok(TriMesh::try_from_indices(raw.points.into_iter().map(Point::from).collect(), &raw.faces)?)
    };
    let rigid = |mesh: &TriMesh| SkinWeights::from_rows(mesh.points().iter().map(|_| vec![(JointId(0), 1.0)]));
    let (body, garment) = (mesh(&body)?, mesh(&garment)?);
    let skeleton =
        Skeleton { names: vec!["hips".into()], parents: vec![None], joints_in_bind: vec![Point::new(0.0, 0.95, 0.0)] };
    let weights = rigid(&body);
    let mut figure = Figure::bare(skeleton, body, weights);
    let physics = (0..garment.vertex_count()).map(|v| if v < pinned { 0.0 } else { 0.5 }).collect();
    let weights = rigid(&garment);
    figure.layers.push(Layer { physics: Some(physics), ..Layer::plain("skirt", garment, weights) });
    let pose = |frame: usize| {
        let mut pose = Pose::bind(1);
        pose.rotations[0] = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), angle(frame as f64));
        pose
    };
    let track = PoseTrack { fps: 30.0, lead: 0, poses: (0..=30).map(pose).collect() };
    let (mut began, mut processor) = (Instant::now(), processor_secs());
    let (mut wall, mut of_processors) = (Vec::new(), Vec::new());
    let mut on_frame = |frame: &ClothFrame<'_>| {
        if frame.number > 1 {
            wall.push(began.elapsed().as_secs_f64() * 1e3);
            of_processors.push((processor_secs() - processor) * 1e3);
        }
        (began, processor) = (Instant::now(), processor_secs());
    };
    let (mode, params) = (ClothMode::Physics, ClothParams::default());
    let (cloth, report) = simulate(&figure, Skinning::Linear, &track, &params, (mode, solver), None, &mut on_frame)?;
    let (before, after) = (&figure.layers[1].mesh, cloth.layer(1, 30));
    let edges = before.faces().iter().flat_map(|f| [[f[0], f[1]], [f[1], f[2]], [f[2], f[0]]]);
    let length = |points: &dyn Fn(usize) -> Point, [a, b]: [overcoat::geometry::VertexId; 2]| {
        (points(a.index()) - points(b.index())).norm()
    };
    let mut stretch: Vec<f64> =
        edges.map(|edge| length(&|v| after.0[v], edge) / length(&|v| before.points().0[v], edge)).collect();
    stretch.sort_by(f64::total_cmp);
    let median = |values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    println!(
        "{} vertices, 30 fps | {:.0} ms wall | {:.0} ms processors | stretch p99 {:.3} max {:.2} | crossing pairs {:?}",
        after.len(),
        median(&mut wall),
        median(&mut of_processors),
        stretch[stretch.len() * 99 / 100],
        stretch[stretch.len() - 1],
        report.crossing_pairs
    );
    Ok(())
}

/// By how much the body is turned, smoothly between the times of [`TURNS`].
fn angle(frame: f64) -> f64 {
    let after = TURNS.iter().position(|turn| turn.0 >= frame).unwrap_or(TURNS.len() - 1).max(1);
    let ((from, a), (to, b)) = (TURNS[after - 1], TURNS[after]);
    let share = ((frame - from) / (to - from)).clamp(0.0, 1.0);
    a + (b - a) * share * share * (3.0 - 2.0 * share)
}
