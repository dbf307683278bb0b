//! Clips whose floor, height or handedness is not what it seems.

use super::figure;
use super::rigs::{Turn, index_of, isometry, performance};
use crate::formats::{RawMotion, RawTransform};
use crate::geometry::Vec3;
use crate::motion::ground::Ground;
use crate::motion::{Clip, MotionParams, MotionReport, PoseTrack, follow};
use nalgebra::Quaternion;

fn followed(motion: &RawMotion) -> (PoseTrack, MotionReport) {
    follow(&Clip::new("x", motion.clone()), figure(), None, None, &MotionParams::default()).unwrap()
}

/// Heights of the lowest sole above the floor in the frames of the clip.
fn soles(track: &PoseTrack) -> Vec<f64> {
    let ground = Ground::of(figure());
    let skeleton = &figure().skeleton;
    track.clip_poses().iter().map(|pose| ground.lowest_of_soles(skeleton, &skeleton.world_from_bind(pose))).collect()
}

fn says(report: &MotionReport, what: &str) -> bool {
    report.findings.iter().any(|finding| finding.contains(what))
}

#[test]
fn a_seat_on_the_floor_does_not_lift_those_who_stand() {
    let mut motion = performance("idle", 2);
    let count = motion.frames.len();
    let legs = ["leftUpperLeg", "rightUpperLeg"].map(|name| index_of(&motion, name));
    let flexed = Turn::from_axis_angle(&Vec3::x_axis(), -1.5);
    for frame in &mut motion.frames[count / 2..] {
        // Sits 15 cm lower than the person of this figure can.
        frame[0].translation[1] -= 1.0;
        for leg in legs {
            frame[leg].rotation = (flexed * isometry(&frame[leg]).rotation).into_inner().coords.into();
        }
    }
    let (track, report) = followed(&motion);
    let heights = soles(&track);
    let standing = &heights[5..count / 2 - 10];
    assert!(standing.iter().all(|h| h.abs() < 0.02), "{standing:?}");
    assert!(report.raised > 0.05, "the seat was not below the floor: {}", report.raised);
}

#[test]
fn an_even_drift_of_the_root_is_removed_and_a_climb_is_said() {
    let mut drifting = performance("idle", 1);
    let count = drifting.frames.len();
    for (k, frame) in drifting.frames.iter_mut().enumerate() {
        frame[0].translation[1] += 0.4 * k as f64 / count as f64;
    }
    let (track, report) = followed(&drifting);
    // Breathing moves the root too.
    let drifts = ["the root drifts up by 3", "the root drifts up by 4"];
    assert!(drifts.iter().any(|what| says(&report, what)), "{:?}", report.findings);
    assert!(soles(&track).iter().all(|h| h.abs() < 0.02));
    // In one step, as on a stair, it is no drift.
    let mut climbing = performance("idle", 1);
    for frame in &mut climbing.frames[count / 2..] {
        frame[0].translation[1] += 0.18;
    }
    let (track, report) = followed(&climbing);
    assert!(!says(&report, "drifts"), "{:?}", report.findings);
    assert!(says(&report, "nothing touches the floor for"), "{:?}", report.findings);
    assert!(soles(&track).last().unwrap() > &0.15);
    for name in ["walk", "turn", "squat", "idle"] {
        let (_, report) = followed(&performance(name, 1));
        assert!(!says(&report, "drifts") && !says(&report, "nothing touches"), "{name}: {:?}", report.findings);
    }
}

#[test]
fn a_mirrored_clip_is_recognised_and_mirrored_back() {
    let mirror = |t: &RawTransform| {
        let ([x, y, z], q) = (t.translation, Quaternion::from(t.rotation));
        RawTransform { translation: [-x, y, z], rotation: Quaternion::new(q.w, q.i, -q.j, -q.k).coords.into() }
    };
    for name in ["walk", "squat", "turn"] {
        let motion = performance(name, 2);
        let mut mirrored = motion.clone();
        for joint in &mut mirrored.joints {
            joint.rest = mirror(&joint.rest);
            joint.end = joint.end.map(|[x, y, z]| [-x, y, z]);
        }
        mirrored.frames.iter_mut().flatten().for_each(|t| *t = mirror(t));
        let ((expected, own), (track, report)) = (followed(&motion), followed(&mirrored));
        assert!(!says(&own, "mirrored"), "{name}: {:?}", own.findings);
        assert!(says(&report, "the clip was mirrored"), "{name}: {:?}", report.findings);
        let worst =
            track.poses.iter().zip(&expected.poses).flat_map(|(a, b)| {
                a.rotations.iter().zip(&b.rotations).map(|(a, b)| a.angle_to(b)).collect::<Vec<_>>()
            });
        assert!(worst.fold(0.0, f64::max) < 1e-6, "{name}");
    }
}
