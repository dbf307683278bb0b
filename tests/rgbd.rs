//! Fusion of RGB-D frames of a turning person: the surface is right for any camera, turn and gaps.

pub mod turntable;

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, UnitQuaternion, Vector3, Vector6};
use overcoat::formats::{EncodedRecording, read_color_picture, write_color_jpeg};
use overcoat::scan::{Fusion, FusionError, FusionParams, fuse};
use turntable::{Shot, Turntable, distance};

/// Half as fine as usual, for images less than half as large.
fn params() -> FusionParams {
    FusionParams { voxel: 0.008, truncation: 0.03, tracking_voxel: 0.01, ..FusionParams::default() }
}

/// Millimetres: a fifth of a pixel, which is 14 mm at 2 m; half of it is what larger images reach as well.
const NEAR: f64 = 3.0;

fn fused(recording: &EncodedRecording) -> Fusion {
    fuse(recording, &params(), &mut |_| {}).unwrap()
}

/// Mean distance of the surface from the person, millimetres, after the motion that brings them together, found from the
/// first frame's true pose.
fn off_mm(fusion: &Fusion, shots: &[Shot]) -> f64 {
    let first = &fusion.report.poses[0];
    let mut motion = shots[first.frame].person_from_camera * first.model_from_camera.inverse();
    let points: Vec<Point3<f64>> = fusion.mesh.points.iter().step_by(17).map(|&p| Point3::from(p)).collect();
    for _ in 0..10 {
        let (mut matrix, mut vector) = (Matrix6::zeros(), Vector6::zeros());
        for p in points.iter().map(|p| motion * p) {
            let step = |e: Vector3<f64>| distance(&(p + e * 1e-4)) - distance(&(p - e * 1e-4));
            let Some(n) = Vector3::new(step(Vector3::x()), step(Vector3::y()), step(Vector3::z())).try_normalize(1e-9)
            else {
                continue;
            };
            let arm = p.coords.cross(&n);
            let row = Vector6::new(arm.x, arm.y, arm.z, n.x, n.y, n.z);
            matrix += row * row.transpose();
            vector += row * distance(&p);
        }
        let step = -matrix.cholesky().unwrap().solve(&vector);
        let rotation = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
        motion = Isometry3::from_parts(step.fixed_rows::<3>(3).into_owned().into(), rotation) * motion;
    }
    1e3 * points.iter().map(|p| distance(&(motion * p)).abs()).sum::<f64>() / points.len() as f64
}

/// Root mean square of the camera's direction against truth, degrees, after the best common rotation.
fn path_deg(fusion: &Fusion, shots: &[Shot]) -> f64 {
    let pairs: Vec<_> = fusion
        .report
        .poses
        .iter()
        .map(|p| (p.model_from_camera.rotation, shots[p.frame].person_from_camera.rotation))
        .collect();
    let sum: Matrix3<f64> = pairs.iter().map(|(a, b)| (b * a.inverse()).to_rotation_matrix().into_inner()).sum();
    let mean = UnitQuaternion::from_matrix(&sum);
    let squares: f64 = pairs.iter().map(|(a, b)| (mean * a).angle_to(b).powi(2)).sum();
    (squares / pairs.len() as f64).sqrt().to_degrees()
}

fn says(fusion: &Fusion, words: &str) -> bool {
    fusion.findings.iter().any(|f| f.contains(words))
}

#[test]
fn a_turn_is_fused_closed_and_coloured_with_the_same_bytes_on_one_thread() {
    let turntable = Turntable::default();
    let shots = turntable.shots();
    let recording = turntable.recording_of(&shots);
    let fusion = fused(&recording);
    let (off, path) = (off_mm(&fusion, &shots), path_deg(&fusion, &shots));
    assert!(off < NEAR && path < 0.5, "{off} mm, {path}°: {:?}", fusion.findings);
    let report = &fusion.report;
    assert!(report.loops > 0 && report.loop_mm < 3.0 && report.loop_deg < 0.3, "{report:?}");
    assert!((report.turns - 1.0).abs() < 0.02 && report.lost.is_empty());
    assert!(says(&fusion, "removed the floor, 0.9"), "{:?}", fusion.findings);
    let low = fusion.mesh.points.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
    let high = fusion.mesh.points.iter().map(|p| p[1]).fold(0.0, f64::max);
    assert!((-0.01..0.06).contains(&low) && (1.6..1.8).contains(&high), "feet at 0, Y up: {low} to {high}");
    let colors = fusion.mesh.colors.as_ref().unwrap();
    let right = fusion.mesh.points.iter().zip(colors).filter(|(p, c)| (p[1] > 1.0) == (c[0] > c[2])).count();
    assert!(right as f64 > 0.97 * colors.len() as f64);
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(|| fused(&recording));
    assert_eq!(alone.mesh, fusion.mesh);
    assert_eq!(alone.report, fusion.report);
}

#[test]
fn half_a_turn_is_a_partial_scan_with_a_warning() {
    let turntable = Turntable { frames: 20, turn_deg: 180.0, ..Turntable::default() };
    let shots = turntable.shots();
    let fusion = fused(&turntable.recording_of(&shots));
    assert!(says(&fusion, "this is a partial scan"), "{:?}", fusion.findings);
    assert_eq!(fusion.report.loops, 0);
    assert!(off_mm(&fusion, &shots) < NEAR, "{}", off_mm(&fusion, &shots));
}

#[test]
fn two_turns_are_closed_and_counted() {
    let turntable = Turntable { frames: 60, turn_deg: 710.0, ..Turntable::default() };
    let shots = turntable.shots();
    let fusion = fused(&turntable.recording_of(&shots));
    assert!((fusion.report.turns - 2.0).abs() < 0.03, "{}", fusion.report.turns);
    assert!(fusion.report.loop_mm < 3.0 && path_deg(&fusion, &shots) < 0.5, "{:?}", fusion.findings);
}

#[test]
fn a_camera_on_its_side_either_way_or_upside_down_makes_no_difference() {
    for (roll_deg, [width, height]) in [(90.0, [200, 160]), (-90.0, [200, 160]), (180.0, [160, 200])] {
        let turntable = Turntable { roll_deg, width, height, ..Turntable::default() };
        let shots = turntable.shots();
        let fusion = fused(&turntable.recording_of(&shots));
        let off = off_mm(&fusion, &shots);
        assert!(off < NEAR, "{roll_deg}: {off} mm, {:?}", fusion.findings);
        let high = fusion.mesh.points.iter().map(|p| p[1]).fold(0.0, f64::max);
        assert!((1.6..1.8).contains(&high), "{roll_deg}: the floor says where up is, {high}");
    }
}

#[test]
fn dropped_and_duplicate_frames_and_missing_colours_are_tolerated() {
    let turntable = Turntable::default();
    let shots = turntable.shots();
    let mut recording = turntable.recording_of(&shots);
    // Without times, a gap comes as a surprise: 10° a frame, then 20°, then 0°.
    recording.frames.iter_mut().for_each(|f| f.secs = None);
    let twice = recording.frames[20].clone();
    recording.frames.insert(20, twice);
    recording.frames.remove(11);
    recording.frames[5].color = None;
    let fusion = fused(&recording);
    assert!(says(&fusion, "skipped 1 frame identical to the previous frame"), "{:?}", fusion.findings);
    assert!(says(&fusion, "1 of 36 frames have no colour"), "{:?}", fusion.findings);
    assert!(fusion.report.lost.is_empty() && off_mm(&fusion, &shots) < NEAR);
    for frame in &mut recording.frames {
        frame.color = None;
    }
    let grey = fused(&recording);
    assert!(grey.mesh.colors.is_none() && says(&grey, "no colour"));
}

#[test]
fn colour_of_another_size_is_aligned_or_dropped_with_a_message() {
    let turntable = Turntable { frames: 24, turn_deg: 345.0, ..Turntable::default() };
    let shots = turntable.shots();
    let mut recording = turntable.recording_of(&shots);
    let mut resize = |change: &dyn Fn(usize, usize, &overcoat::formats::ColorPicture) -> [u8; 3], width, height| {
        for (frame, shot) in recording.frames.iter_mut().zip(&shots) {
            let small = read_color_picture(&turntable.jpeg(shot)).unwrap();
            let pixels: Vec<_> = (0..width * height).map(|i| change(i % width, i / width, &small)).collect();
            frame.color = Some(("rgb".into(), write_color_jpeg([width, height], &pixels, 92).unwrap()));
        }
        fused(&recording)
    };
    let double = resize(&|x, y, small| small.pixels[y / 2 * 160 + x / 2], 320, 400);
    let colors = double.mesh.colors.as_ref().unwrap();
    let right = double.mesh.points.iter().zip(colors).filter(|(p, c)| (p[1] > 1.0) == (c[0] > c[2])).count();
    assert!(right as f64 > 0.97 * colors.len() as f64);
    let wide = resize(&|_, _, _| [9, 9, 9], 400, 200);
    assert!(wide.mesh.colors.is_none() && says(&wide, "cannot be registered to"), "{:?}", wide.findings);
}

#[test]
fn a_board_under_the_feet_is_removed() {
    let turntable = Turntable { board: Some(0.35), ..Turntable::default() };
    let shots = turntable.shots();
    let fusion = fused(&turntable.recording_of(&shots));
    assert!(says(&fusion, "removed a turntable 12 cm high"), "{:?}", fusion.findings);
    let off = off_mm(&fusion, &shots);
    assert!(off < NEAR, "{off}");
}

#[test]
fn swaying_is_reported() {
    let turntable = Turntable { lean: 0.012, ..Turntable::default() };
    let shots = turntable.shots();
    let fusion = fused(&turntable.recording_of(&shots));
    assert!(says(&fusion, "the person swayed by"), "{:?}", fusion.findings);
    assert!(off_mm(&fusion, &shots) < NEAR, "a lean is a pose: it is followed");
}

#[test]
fn recordings_without_a_turning_person_are_refused_with_the_reason() {
    let refused = |recording: &EncodedRecording| fuse(recording, &params(), &mut |_| {}).unwrap_err();
    let quick = Turntable { frames: 14, ..Turntable::default() };
    assert!(matches!(
        refused(&Turntable { camera_moves: true, ..quick.clone() }.recording()),
        FusionError::CameraMoved { .. }
    ));
    assert!(matches!(
        refused(&Turntable { empty: true, ..quick.clone() }.recording()),
        FusionError::NobodyInView { .. }
    ));
    let still = Turntable { turn_deg: 4.0, ..quick.clone() };
    assert!(matches!(refused(&still.recording()), FusionError::NoTurn { .. }));
    let few = Turntable { frames: 5, ..quick.clone() };
    assert!(matches!(refused(&few.recording()), FusionError::TooFewFrames { count: 5, .. }));
    let mut recording = quick.recording();
    recording.camera.depth_scale = 10.0;
    assert!(matches!(refused(&recording), FusionError::WrongScale { .. }));
}

/// The sequence that comes with the program: a woman who sways a little, 36 frames. Its `groundtruth.txt` goes nowhere
/// but here.
#[test]
fn the_shipped_recording_is_fused_and_its_camera_path_found() {
    let dir = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo/0-body");
    let recording = overcoat::formats::read_recording(&turntable::packed(&dir)).unwrap();
    let fusion = fuse(&recording, &FusionParams::default(), &mut |_| {}).unwrap();
    let report = &fusion.report;
    assert!(report.lost.is_empty() && (report.turns - 1.0).abs() < 0.02, "{report:?}");
    assert!(report.loops > 0 && report.loop_mm < 2.0 && report.loop_deg < 0.2, "{:?}", fusion.findings);
    let truth = std::fs::read_to_string(dir.join("groundtruth.txt")).unwrap();
    let shots: Vec<Shot> = truth
        .lines()
        .filter(|l| !l.starts_with('#'))
        .map(|line| {
            let n: Vec<f64> = line.split_whitespace().map(|w| w.parse().unwrap()).collect();
            let rotation = nalgebra::Quaternion::new(n[7], n[4], n[5], n[6]);
            let rotation = UnitQuaternion::from_quaternion(rotation);
            let person_from_camera = Isometry3::from_parts(Vector3::new(n[1], n[2], n[3]).into(), rotation);
            Shot { depth: Vec::new(), color: Vec::new(), person_from_camera }
        })
        .collect();
    assert_eq!(shots.len(), report.poses.len());
    let path = path_deg(&fusion, &shots);
    assert!(path < 0.6, "{path}°: what the person sways within the turn is in it");
}

/// Rays past the person end nowhere. Taken as unknown, they would let the outlines grow: the person came out 5 mm too
/// stout, and half the turn 10 mm off.
#[test]
fn a_recording_without_background_is_accepted() {
    let bare = Turntable { room: false, ..Turntable::default() };
    let shots = bare.shots();
    let fusion = fused(&bare.recording_of(&shots));
    assert!(
        says(&fusion, "no floor was found") && says(&fusion, "no background was measured"),
        "{:?}",
        fusion.findings
    );
    let off = off_mm(&fusion, &shots);
    assert!(off < NEAR, "{off}");
}
