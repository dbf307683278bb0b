//! Poses written as JSON lines move the figure as before.

use super::figure;
use super::rigs::performance;
use crate::body::Pose;
use crate::formats::{PoseLineWriter, read_pose_lines};
use crate::geometry::Vec3;
use crate::motion::aligned::about_vertical;
use crate::motion::{Clip, MotionParams, follow};
use nalgebra::UnitQuaternion;

/// Nothing but retargeting.
fn plain() -> MotionParams {
    MotionParams { ease_secs: 0.0, plant: false, limits: false, clear: false }
}

/// The poses as a recording of them has them.
fn recorded(poses: &[Pose], fps: f64) -> Vec<u8> {
    let skeleton = &figure().skeleton;
    let parents: Vec<Option<usize>> = skeleton.parents.iter().map(|p| p.map(|p| p.index())).collect();
    let joints: Vec<[f64; 3]> = skeleton.joints_in_bind.iter().map(|p| p.coords.into()).collect();
    let mut writer = PoseLineWriter::begin(Vec::new(), &skeleton.names, &parents, &joints).unwrap();
    for (frame, pose) in poses.iter().enumerate() {
        let root = skeleton.joints_in_bind[0] + pose.translation;
        let rotations: Vec<[f64; 4]> = pose.rotations.iter().map(|q| q.into_inner().coords.into()).collect();
        writer.frame(frame as f64 / fps, root.coords.into(), &rotations).unwrap();
    }
    writer.into_inner()
}

/// The greatest difference of rotations in degrees, and of the way of the hips in metres, of a recording that is played.
fn differences(poses: &[Pose]) -> (f64, f64) {
    let raw = read_pose_lines(&recorded(poses, 30.0)).unwrap();
    assert_eq!((raw.notes.as_slice(), raw.frames.len()), ([].as_slice(), poses.len()));
    let (track, _) = follow(&Clip::new("own", raw), figure(), None, None, &plain()).unwrap();
    assert_eq!((track.fps, track.poses.len()), (30.0, poses.len()));
    let (mut angle, mut way): (f64, f64) = (0.0, 0.0);
    for (found, expected) in track.poses.iter().zip(poses) {
        let each = found.rotations.iter().zip(&expected.rotations);
        angle = each.map(|(a, b)| a.angle_to(b).to_degrees()).fold(angle, f64::max);
        way = way.max((found.translation - expected.translation).norm());
    }
    (angle, way)
}

#[test]
fn a_recorded_clip_plays_as_it_was() {
    for name in ["walk", "turn", "squat", "idle"] {
        let clip = Clip::new(name, performance(name, 5));
        let mut poses =
            follow(&clip, figure(), None, None, &MotionParams { ease_secs: 0.0, ..MotionParams::default() })
                .unwrap()
                .0
                .poses;
        // A recording may turn any joint of the body.
        for pose in poses.iter_mut().skip(30) {
            for (j, rotation) in pose.rotations.iter_mut().enumerate().take(22).skip(1) {
                let axis = Vec3::new((j as f64).sin(), (2.0 * j as f64).cos(), (3.0 * j as f64).sin());
                *rotation *= UnitQuaternion::from_scaled_axis(axis * 0.05);
            }
        }
        let (angle, way) = differences(&poses);
        assert!(angle < 1e-4, "{name}: {angle}°");
        // The whole clip may be moved onto the floor, and raised above it.
        assert!(way < 0.04, "{name}: {way} m");
    }
}

/// The reference pose is the bind pose, whether or not a frame stands.
#[test]
fn a_recording_of_one_pose_plays_as_it_was() {
    let skeleton = &figure().skeleton;
    let mut sitting = Pose::bind(skeleton.len());
    for side in crate::body::Side::BOTH {
        for (joint, angle) in
            [(crate::body::HumanJoint::UpperLeg(side), -1.5), (crate::body::HumanJoint::LowerLeg(side), 1.5)]
        {
            let j = skeleton.find(joint).unwrap();
            sitting.rotations[j.index()] = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), angle);
        }
    }
    let mut turned = sitting.clone();
    turned.rotations[0] = about_vertical(0.6);
    for poses in [vec![Pose::bind(skeleton.len()); 3], vec![sitting; 12], vec![turned; 12]] {
        let (angle, _) = differences(&poses);
        assert!(angle < 1e-4, "{angle}°");
    }
}
