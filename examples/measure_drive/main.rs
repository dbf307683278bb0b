//! Drives the figures of sessions by recorded streams, and compares with the true joints and surfaces (row T21 of the
//! evaluation): `measure_drive SESSION=STREAM …`; a folder STREAM holds `stream.jsonl` and `truth/` with `joints.json` and
//! `frame_NNN.ply`.

use overcoat::body::{Figure, HumanJoint, Pose, Side};
use overcoat::drive::{
    LaplacianDriver, PlayedFrame, Player, StreamKind, StreamOptions, StreamReader, TransferParams, embedded_library,
};
use overcoat::formats::{MeshKind, read_mesh};
use overcoat::geometry::{Point, SurfaceIndex, TriMesh};
use overcoat::session::Session;
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

fn main() {
    for pair in std::env::args().skip(1) {
        let (session, stream) = pair.split_once('=').expect("SESSION=STREAM");
        let figure = Session::open(Path::new(session)).unwrap().figure_of_last_step().unwrap();
        measure(&figure, Path::new(stream), &pair);
    }
}

fn measure(figure: &Figure, stream: &Path, name: &str) {
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
    let ms = began.elapsed().as_secs_f64() * 1e3 / driven.len() as f64;
    let calibration = player.calibration().unwrap();
    let steps = driven.iter().map(|d| d.steps).sum::<usize>() as f64 / driven.len() as f64;
    let residual = driven.iter().map(|d| d.distance).sum::<f64>() / driven.len() as f64;
    println!("{name}: scale {:.3}, notes {:?}", calibration.scale, calibration.notes);
    println!("  {ms:.2} ms and {steps:.1} steps per frame, landmarks {:.1} mm", residual * 1e3);

    let truth: Value =
        serde_json::from_str(&std::fs::read_to_string(stream.join("truth/joints.json")).unwrap()).unwrap();
    let solved = std::env::var_os("LAPLACIAN").map(|_| {
        let library = embedded_library().unwrap();
        let began = std::time::Instant::now();
        let mut laplacian = LaplacianDriver::try_new(figure, calibration, &library, TransferParams::default()).unwrap();
        println!(
            "  {} vertices, prepared in {:.0} ms",
            laplacian.body().vertex_count(),
            began.elapsed().as_secs_f64() * 1e3
        );
        let began = std::time::Instant::now();
        let frames: Vec<_> = driven.iter().map(|d| laplacian.follow(calibration, &d.places)).collect();
        let ms = began.elapsed().as_secs_f64() * 1e3 / frames.len() as f64;
        let iterations = frames.iter().map(|f| f.solved.iterations).sum::<usize>() as f64 / frames.len() as f64;
        println!("  Laplacian: {ms:.1} ms and {iterations:.1} iterations per frame");
        for (d, f) in driven.iter_mut().zip(&frames) {
            d.pose = laplacian.pose_of(f);
        }
        frames
    });
    let poses: Vec<&Pose> = driven.iter().map(|d| &d.pose).collect();
    if std::env::var_os("DEBUG").is_some() {
        debug(figure, calibration, &driven, &truth);
    }
    let skeleton = &figure.skeleton;
    let (mut raw, mut fixed) = (Vec::new(), Vec::new());
    for (joint, bone) in compared() {
        let j = skeleton.find(joint).unwrap().index();
        let truth_at = |k: usize| point(&truth["frames"][k][&bone]).unwrap();
        let first = skeleton.world_from_bind(poses[0]);
        let in_bind = first[j].inverse() * calibration.in_world_point(&truth_at(0));
        let (mut of_raw, mut of_fixed) = (0.0, 0.0);
        for (k, pose) in poses.iter().enumerate() {
            let world = skeleton.world_from_bind(pose);
            let here = truth_at(k);
            of_raw += (calibration.in_stream(&(world[j] * skeleton.joints_in_bind[j])) - here).norm();
            of_fixed += (calibration.in_stream(&(world[j] * in_bind)) - here).norm();
        }
        let n = poses.len() as f64;
        let at0 = calibration.in_stream(&skeleton.joints_in_world(poses[0])[j]) - truth_at(0);
        print!("    at 0 ({:6.1} {:6.1} {:6.1})", at0.x * 1e3, at0.y * 1e3, at0.z * 1e3);
        println!(
            "    {:14} {:5.1} mm, fixed at calibration {:5.1} mm",
            joint.name(),
            of_raw / n * 1e3,
            of_fixed / n * 1e3
        );
        raw.push(of_raw / n * 1e3);
        fixed.push(of_fixed / n * 1e3);
    }
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    println!("  joints {:.1} mm, fixed at calibration {:.1} mm", mean(&raw), mean(&fixed));

    let Some(first) = true_mesh(&stream.join("truth/frame_000.ply")) else { return };
    let index = SurfaceIndex::prepare(&first);
    let body = figure.body();
    let surface_at = |k: usize| match &solved {
        Some(frames) => body.mesh.with_points(frames[k].solved.points.clone()),
        None => body.posed(skeleton, poses[k]),
    };
    let at_first = surface_at(0);
    let nearest: Vec<_> = at_first.points().iter().map(|p| index.closest(&calibration.in_stream(p))).collect();
    let mut all = Vec::new();
    for k in (0..600).step_by(60) {
        let Some(mesh) = true_mesh(&stream.join(format!("truth/frame_{k:03}.ply"))) else { continue };
        let posed = surface_at(k);
        let mut sum = 0.0;
        for (p, at) in posed.points().iter().zip(&nearest) {
            let corners = mesh.triangle(at.face);
            let there: Point =
                (0..3).map(|c| corners[c].coords * at.barycentric[c]).sum::<overcoat::geometry::Vec3>().into();
            sum += (calibration.in_stream(p) - there).norm();
        }
        all.push(sum / posed.points().len() as f64 * 1e3);
    }
    let shown: Vec<String> = all.iter().map(|x| format!("{x:.1}")).collect();
    println!("  surface {:.1} mm: {}", mean(&all), shown.join(" "));
}

/// Per frame: how far an elbow is off, and the angle of its joint.
#[allow(dead_code)]
fn debug(figure: &Figure, calibration: &overcoat::drive::Calibration, driven: &[PlayedFrame], truth: &Value) {
    let skeleton = &figure.skeleton;
    let find = |j: HumanJoint| skeleton.find(j).unwrap().index();
    for k in (60..600).step_by(20) {
        let pose = &driven[k].pose;
        let joints = skeleton.joints_in_world(pose);
        let at = calibration.attached.posed(skeleton, pose);
        let mut line = format!("{k}");
        for (j, bone, l) in [
            (HumanJoint::UpperArm(Side::Right), "upperarm01.R", overcoat::drive::Landmark::Shoulder(Side::Right)),
            (HumanJoint::LowerArm(Side::Right), "lowerarm01.R", overcoat::drive::Landmark::Elbow(Side::Right)),
            (HumanJoint::Hand(Side::Right), "wrist.R", overcoat::drive::Landmark::Wrist(Side::Right)),
        ] {
            let here = point(&truth["frames"][k][bone]).unwrap();
            let off = (joints[find(j)] - here).norm() * 1e3;
            let lm = driven[k].places[l.index()].map(|p| (p - at.as_slice()[l.index()]).norm() * 1e3).unwrap_or(-1.0);
            line += &format!("  {off:.0} ({lm:.0})");
        }
        let v = pose.rotations[find(HumanJoint::LowerArm(Side::Right))].scaled_axis().map(|x| x.to_degrees().round());
        let u = pose.rotations[find(HumanJoint::UpperArm(Side::Right))].scaled_axis().map(|x| x.to_degrees().round());
        println!("{line}  elbow {} {} {}  shoulder {} {} {}", v.x, v.y, v.z, u.x, u.y, u.z);
    }
}
