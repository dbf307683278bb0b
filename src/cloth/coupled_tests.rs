//! Two layers around a tube that bends like an arm, where skinning alone makes them cross.

use super::{ClothError, ClothMode, ClothParams, ClothReport, ClothSolver, ClothTrack, simulate};
use crate::body::{Figure, JointId, Layer, Pose, Skeleton, SkinWeights, Skinning};
use crate::geometry::{PerVertex, Point, TriMesh, Vec3, intersecting_pairs, self_intersecting_pairs};
use crate::motion::PoseTrack;
use nalgebra::UnitQuaternion;

/// Vertices around a tube and along it.
const AROUND: usize = 24;
const ALONG: usize = 40;

/// An open tube of 0.6 m along Y.
fn tube(radius: f64) -> TriMesh {
    let at = |i: usize, j: usize| {
        let angle = std::f64::consts::TAU * i as f64 / AROUND as f64;
        Point::new(radius * angle.cos(), 0.6 * j as f64 / (ALONG - 1) as f64, radius * angle.sin())
    };
    let points = (0..ALONG).flat_map(|j| (0..AROUND).map(move |i| at(i, j))).collect();
    let mut faces = Vec::new();
    for j in 0..ALONG - 1 {
        for i in 0..AROUND {
            let next = (i + 1) % AROUND;
            let [a, b, c, d] = [i + AROUND * j, next + AROUND * j, i + AROUND * (j + 1), next + AROUND * (j + 1)];
            faces.extend([[a, c, b], [b, c, d]].map(|face| face.map(|v| v as u32)));
        }
    }
    TriMesh::try_from_indices(points, &faces).unwrap()
}

/// An arm with an elbow in the middle, and sleeves of the given radii, half of whose motion is physics.
pub(super) fn arm(sleeves: &[f64]) -> Figure {
    let skeleton = Skeleton {
        names: vec!["upper".into(), "lower".into()],
        parents: vec![None, Some(JointId(0))],
        joints_in_bind: vec![Point::origin(), Point::new(0.0, 0.3, 0.0)],
    };
    let layer = |name: &str, radius: f64| {
        let mesh = tube(radius);
        let share = |p: &Point| ((p.y - 0.25) / 0.1).clamp(0.0, 1.0);
        let rows = mesh.points().iter().map(|p| vec![(JointId(0), 1.0 - share(p)), (JointId(1), share(p))]);
        let weights = SkinWeights::from_rows(rows.collect::<Vec<_>>());
        Layer::plain(name, mesh, weights)
    };
    let mut layers = vec![layer("body", 0.05)];
    layers.extend(sleeves.iter().map(|&radius| {
        let cloth = layer("sleeve", radius);
        // Sleeves this coarse would not bend with an elbow if they were woven.
        let fabric = Some("jersey".into());
        Layer { physics: Some(PerVertex::filled(0.4, cloth.mesh.vertex_count())), fabric, ..cloth }
    }));
    Figure { skeleton, layers }
}

/// The elbow bends by `angle` degrees in ten frames, and stays so for five.
pub(super) fn bend(angle: f64) -> PoseTrack {
    let pose = |frame: usize| {
        let turned = (angle * (frame as f64 / 10.0).min(1.0)).to_radians();
        let mut pose = Pose::bind(2);
        pose.rotations[1] = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), turned);
        pose
    };
    PoseTrack { fps: 30.0, lead: 0, poses: (0..16).map(pose).collect() }
}

const COUPLED: (ClothMode, ClothSolver) = (ClothMode::Coupled, ClothSolver::Constraints);

fn moved(figure: &Figure, track: &PoseTrack) -> (ClothTrack, ClothReport) {
    moved_by(COUPLED, figure, track)
}

pub(super) fn moved_by(how: (ClothMode, ClothSolver), figure: &Figure, track: &PoseTrack) -> (ClothTrack, ClothReport) {
    simulate(figure, Skinning::Linear, track, &ClothParams::default(), how, None, &mut |_| {}).unwrap()
}

pub(super) fn crossings(meshes: &[TriMesh]) -> usize {
    let within: usize = meshes.iter().map(|mesh| self_intersecting_pairs(mesh).len()).sum();
    let between = |k: usize| (0..k).map(|j| intersecting_pairs(&meshes[j], &meshes[k]).len()).sum::<usize>();
    within + (0..meshes.len()).map(between).sum::<usize>()
}

#[test]
fn no_frame_has_a_crossing_where_skinning_alone_has_many() {
    let (figure, track) = (arm(&[0.053, 0.057]), bend(110.0));
    let skinned = crossings(&figure.posed(&track.poses[15]));
    assert!(skinned > 50, "{skinned} pairs of faces cross by skinning alone");
    let (cloth, report) = moved(&figure, &track);
    assert_eq!((cloth.frames.len(), report.crossing_pairs, report.stopped_steps), (16, Some(0), 0), "{report:?}");
    for frame in 0..16 {
        let surfaces: Vec<TriMesh> =
            figure.layers.iter().zip(cloth.layers_in(frame)).map(|(l, points)| l.mesh.with_points(points)).collect();
        assert_eq!(crossings(&surfaces), 0, "frame {frame}");
    }
    // The forearm arrives, and its sleeve with it.
    let (last, arrived) = (cloth.layers_in(15), figure.posed(&track.poses[15]));
    for (layer, mesh) in last.iter().zip(&arrived) {
        let tip = AROUND * ALONG - 1;
        assert!((layer.0[tip] - mesh.points().0[tip]).norm() < 0.02);
    }
}

#[test]
fn a_figure_carried_into_a_pose_crosses_nothing_and_arrives() {
    let (figure, track) = (arm(&[0.053, 0.057]), bend(110.0));
    let arrived = figure.posed(&track.poses[15]);
    let carried = super::carried(&figure, &track.poses[15]).unwrap();
    assert_eq!(crossings(&carried), 0);
    for (layer, mesh) in carried.iter().zip(&arrived) {
        assert_eq!(layer.faces(), mesh.faces());
        let tip = AROUND * ALONG - 1;
        assert!((layer.points().0[tip] - mesh.points().0[tip]).norm() < 0.02);
    }
}

#[test]
fn one_thread_and_four_make_the_same_bytes() {
    let (figure, track) = (arm(&[0.053, 0.057]), bend(60.0));
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| moved(&figure, &track).0)
    };
    assert!(with(1) == with(4));
}

#[test]
fn a_figure_that_stays_in_the_bind_pose_does_not_move() {
    let figure = arm(&[0.0503, 0.06]);
    let (cloth, report) = moved(&figure, &PoseTrack { fps: 30.0, lead: 0, poses: vec![Pose::bind(2); 61] });
    let far = |a: &[f32; 3], b: &[f32; 3]| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 1e-6);
    let strayed = cloth.frames[60].iter().zip(&cloth.frames[0]).filter(|(a, b)| far(a, b)).count();
    assert_eq!(strayed, 0, "two seconds of gravity move nothing: {report:?}");
}

#[test]
fn loose_cloth_swings_and_firm_cloth_follows() {
    let mut figure = arm(&[0.07]);
    let swing = |figure: &Figure| {
        let report = moved(figure, &bend(60.0)).1;
        (report.swing, report.hem_swing)
    };
    let loose = swing(&figure);
    figure.layers[1].physics = None;
    let firm = swing(&figure);
    assert!(loose.0 > 2e-3 && firm.0 < 0.5 * loose.0, "{loose:?} {firm:?}");
    // At the wrist firm cloth does not swing at all; at the elbow it bulges.
    assert!(loose.1 > 5e-3 && firm.1 < 0.1 * loose.1, "{loose:?} {firm:?}");
}

#[test]
fn cloth_calms_down_when_the_body_rests() {
    let (figure, mut track) = (arm(&[0.07]), bend(60.0));
    track.poses.extend(vec![track.poses[15].clone(); 60]);
    let cloth = moved(&figure, &track).0;
    let fastest = |frame: usize| {
        let (before, after) = (cloth.layer(1, frame - 1), cloth.layer(1, frame));
        before.iter().zip(after.iter()).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    let fastest_of = |frames: std::ops::Range<usize>| frames.map(fastest).fold(0.0, f64::max);
    let (first, last) = (fastest_of(11..26), fastest_of(61..76));
    assert!(first > 1e-3 && last < 0.1e-3, "{first} m per frame at first, {last} after two seconds");
}

/// Takes a quarter of an hour: `just cloth-long`.
#[test]
#[ignore = "ten thousand frames"]
fn ten_thousand_frames_of_a_waving_arm_neither_cross_nor_explode() {
    let figure = arm(&[0.056]);
    let pose = |frame: usize| {
        // Two rhythms that never meet again, up to 9 degrees per frame.
        let time = frame as f64 / 30.0;
        let turned = 60.0 + 30.0 * (4.0 * time).sin() + 30.0 * (5.7 * time).sin();
        let mut pose = Pose::bind(2);
        let ease = (time / 0.5).min(1.0);
        pose.rotations[1] = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), (ease * turned).to_radians());
        pose.rotations[0] = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), ease * (0.7 * time).sin());
        pose
    };
    let track = PoseTrack { fps: 30.0, lead: 0, poses: (0..10_001).map(pose).collect() };
    let (cloth, report) = moved(&figure, &track);
    assert!(cloth.frames.iter().flatten().flatten().all(|x| x.is_finite() && x.abs() < 2.0));
    assert_eq!((cloth.frames.len(), report.crossing_pairs), (10_001, Some(0)), "{report:?}");
    // Where the elbow bends by 120°, skinning alone moves skin through that of the other half of the arm, by 16 mm for each half.
    assert!(report.yielded < 0.025 && report.stretch_p99 < 2.0, "{report:?}");
}

#[test]
fn layers_that_cross_from_the_start_an_unknown_fabric_and_impossible_parameters_are_refused() {
    let run = |figure: &Figure, params: &ClothParams| {
        simulate(figure, Skinning::Linear, &bend(10.0), params, COUPLED, None, &mut |_| {}).unwrap_err()
    };
    let mut figure = arm(&[0.053]);
    let wild = ClothParams { damping: f64::NAN, ..ClothParams::default() };
    assert!(matches!(run(&figure, &wild), ClothError::Parameter(_)));
    figure.layers[1].fabric = Some("moonshine".into());
    assert!(run(&figure, &ClothParams::default()).to_string().contains("moonshine"));
    figure.layers[1].fabric = None;
    // A sleeve beside the arm, through its skin.
    figure.layers[1].mesh = figure.layers[1].mesh.map_points(|p| p + Vec3::x() * 0.02);
    assert!(matches!(run(&figure, &ClothParams::default()), ClothError::Crossing { pairs } if pairs > 10));
}

#[test]
fn a_simulation_resumed_from_a_checkpoint_ends_as_one_never_stopped() {
    let (figure, track) = (arm(&[0.052, 0.06]), bend(60.0));
    let mut checkpoints = Vec::new();
    let whole = simulate(&figure, Skinning::Linear, &track, &ClothParams::default(), COUPLED, None, &mut |frame| {
        checkpoints.push((frame.track.clone(), frame.checkpoint()));
    });
    let at = checkpoints.swap_remove(7);
    let mut seen = Vec::new();
    let rest = simulate(&figure, Skinning::Linear, &track, &ClothParams::default(), COUPLED, Some(at), &mut |frame| {
        seen.push(frame.number);
    });
    assert_eq!(seen, (8..16).collect::<Vec<_>>());
    assert_eq!(rest.unwrap(), whole.unwrap());
}
