//! Recorded streams against the true joints and surfaces: row T21 of the evaluation.

use overcoat::body::{Figure, HumanJoint, Pose, Side};
use overcoat::drive::{
    LaplacianDriver, PlayedFrame, Player, StreamKind, StreamOptions, StreamReader, TransferParams, embedded_library,
};
use overcoat::formats::{MeshKind, read_mesh};
use overcoat::geometry::{Point, SurfaceIndex, TriMesh, Vec3};
use serde_json::Value;
use std::path::Path;

fn point(value: &Value) -> Option<Point> {
    let xyz: Vec<f64> = value.as_array()?.iter().filter_map(Value::as_f64).collect();
    (xyz.len() == 3).then(|| Point::new(xyz[0], xyz[1], xyz[2]))
}

/// The true joints that are compared, with the bone of the truth whose head they are.
fn compared() -> Vec<(HumanJoint, String)> {
    let mut all = vec![(HumanJoint::Neck, "neck01".into()), (HumanJoint::Head, "head".into())];
    for side in Side::BOTH {
        let end = if side == Side::Left { "L" } else { "R" };
        for (joint, bone) in [
            (HumanJoint::UpperArm(side), "upperarm01"),
            (HumanJoint::LowerArm(side), "lowerarm01"),
            (HumanJoint::Hand(side), "wrist"),
            (HumanJoint::UpperLeg(side), "upperleg01"),
            (HumanJoint::LowerLeg(side), "lowerleg01"),
            (HumanJoint::Foot(side), "foot"),
        ] {
            all.push((joint, format!("{bone}.{end}")));
        }
    }
    all
}

fn true_mesh(path: &Path) -> Option<TriMesh> {
    let raw = read_mesh(MeshKind::Ply, std::fs::File::open(path).ok()?).ok()?;
    let points = raw.points.iter().map(|p| Point::new(p[0], p[1], p[2])).collect();
    TriMesh::try_from_indices(points, &raw.faces).ok()
}

/// Plays `STREAM/stream.jsonl` by both methods, beside `STREAM/truth/joints.json` and `frame_NNN.ply`.
pub fn measure(figure: &Figure, stream: &Path, name: &str) {
    let file = std::io::BufReader::new(std::fs::File::open(stream.join("stream.jsonl")).unwrap());
    let mut reader = StreamReader::new(file, StreamOptions::default());
    let mut player = Player::new(figure, StreamKind::default(), None);
    let mut driven: Vec<PlayedFrame> = Vec::new();
    let mut began = std::time::Instant::now();
    while let Some(frame) = reader.next_frame() {
        if driven.is_empty() {
            began = std::time::Instant::now();
        }
        driven.extend(player.push(frame.unwrap()).unwrap());
    }
    let count = driven.len() as f64;
    let ms = began.elapsed().as_secs_f64() * 1e3 / count;
    let calibration = player.calibration().unwrap();
    let truth: Value =
        serde_json::from_str(&std::fs::read_to_string(stream.join("truth/joints.json")).unwrap()).unwrap();
    let compare = |what: &str, ms: f64, steps: f64, poses: &[Pose], surface: &dyn Fn(usize) -> TriMesh| {
        let in_stream = |p: &Point| calibration.in_stream(p);
        let (raw, fixed) = joints(figure, poses, &truth, &in_stream, &|p| calibration.in_world_point(p));
        let surfaces = surfaces(stream, &in_stream, surface);
        let surfaces = surfaces.map_or("-".into(), |mm| format!("{mm:.1}"));
        println!("| {name} | {what} | {fixed:.1} | {raw:.1} | {surfaces} | {ms:.1} | {steps:.1} |");
    };
    let poses: Vec<Pose> = driven.iter().map(|d| d.pose.clone()).collect();
    let steps = driven.iter().map(|d| d.steps).sum::<usize>() as f64 / count;
    compare("inverse kinematics", ms, steps, &poses, &|k| figure.body().posed(&figure.skeleton, &poses[k]));

    let library = embedded_library().unwrap();
    let mut laplacian = LaplacianDriver::try_new(figure, calibration, &library, TransferParams::default()).unwrap();
    let began = std::time::Instant::now();
    let frames: Vec<_> = driven.iter().map(|d| laplacian.follow(calibration, &d.places)).collect();
    let ms = began.elapsed().as_secs_f64() * 1e3 / count;
    let steps = frames.iter().map(|f| f.solved.iterations).sum::<usize>() as f64 / count;
    let poses: Vec<Pose> = frames.iter().map(|f| laplacian.pose_of(f)).collect();
    compare("Laplacian", ms, steps, &poses, &|k| figure.body().mesh.with_points(frames[k].solved.points.clone()));
}

/// Mean error of the joints in millimetres: ours against the true ones, and the true ones of the first frame, carried along,
/// against those of the others.
fn joints(
    figure: &Figure,
    poses: &[Pose],
    truth: &Value,
    in_stream: &dyn Fn(&Point) -> Point,
    in_world: &dyn Fn(&Point) -> Point,
) -> (f64, f64) {
    let skeleton = &figure.skeleton;
    let (mut raw, mut fixed, compared) = (0.0, 0.0, compared());
    for (joint, bone) in &compared {
        let j = skeleton.find(*joint).unwrap().index();
        let truth_at = |k: usize| point(&truth["frames"][k][bone]).unwrap();
        let in_bind = skeleton.world_from_bind(&poses[0])[j].inverse() * in_world(&truth_at(0));
        for (k, pose) in poses.iter().enumerate() {
            let world = skeleton.world_from_bind(pose)[j];
            raw += (in_stream(&(world * skeleton.joints_in_bind[j])) - truth_at(k)).norm();
            fixed += (in_stream(&(world * in_bind)) - truth_at(k)).norm();
        }
    }
    let mm = 1e3 / (compared.len() * poses.len()) as f64;
    (raw * mm, fixed * mm)
}

/// Mean distance of corresponding points of the surface in millimetres; they are those that are nearest in the first frame.
fn surfaces(stream: &Path, in_stream: &dyn Fn(&Point) -> Point, surface: &dyn Fn(usize) -> TriMesh) -> Option<f64> {
    let first = true_mesh(&stream.join("truth/frame_000.ply"))?;
    let index = SurfaceIndex::prepare(&first);
    let nearest: Vec<_> = surface(0).points().iter().map(|p| index.closest(&in_stream(p))).collect();
    let mut all = Vec::new();
    for k in (0..600).step_by(60) {
        let Some(mesh) = true_mesh(&stream.join(format!("truth/frame_{k:03}.ply"))) else { continue };
        let posed = surface(k);
        let mut sum = 0.0;
        for (p, at) in posed.points().iter().zip(&nearest) {
            let corners = mesh.triangle(at.face);
            let there: Point = (0..3).map(|c| corners[c].coords * at.barycentric[c]).sum::<Vec3>().into();
            sum += (in_stream(p) - there).norm();
        }
        all.push(sum / posed.points().len() as f64 * 1e3);
    }
    Some(all.iter().sum::<f64>() / all.len() as f64)
}
