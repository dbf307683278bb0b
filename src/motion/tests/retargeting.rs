//! Segments point where the clip's do, whatever the rig; retargeting a figure's own motion to it changes nothing.

use super::figure;
use super::rigs::{
    Turn, a_pose, index_of, isometry, performance, placed, t_pose, with_own_axes, with_rest, with_twist_bones,
    world_of, z_up,
};
use crate::body::{Grasp, HandJoints, HumanJoint, JointId, Pose, Side};
use crate::formats::{RawJoint, RawMotion, RawTransform, read_bvh, write_bvh};
use crate::geometry::{Point, Vec3};
use crate::motion::aligned::{bone_end, heading};
use crate::motion::{Clip, FrameRange, MotionParams, PoseTrack, follow};

/// Nothing but retargeting.
fn plain() -> MotionParams {
    MotionParams { ease_secs: 0.0, plant: false, limits: false, clear: false }
}

fn followed(motion: RawMotion) -> PoseTrack {
    follow(&Clip::new("x", motion), figure(), None, None, &plain()).unwrap().0
}

/// The motion written as BVH and read back.
fn through_bvh(motion: &RawMotion) -> RawMotion {
    let mut bytes = Vec::new();
    write_bvh(motion, &mut bytes).unwrap();
    read_bvh(bytes.as_slice()).unwrap()
}

/// The greatest distance of the figure's limb joints from where their parents and the clip's own segments put them.
fn greatest_error(motion: &RawMotion, track: &PoseTrack, upright: &Turn) -> f64 {
    let skeleton = &figure().skeleton;
    let mut greatest: f64 = 0.0;
    for (frame, pose) in track.poses.iter().enumerate() {
        let joints = skeleton.joints_in_world(pose);
        for joint in HumanJoint::BODY {
            let Some(end) = bone_end(joint).filter(|_| !matches!(joint, HumanJoint::Foot(_))) else { continue };
            let in_clip = |j: HumanJoint| world_of(motion, frame, index_of(motion, j.name())).translation.vector;
            let direction = upright * (in_clip(end) - in_clip(joint)).normalize();
            let at = |j: HumanJoint| joints[skeleton.find(j).unwrap().index()];
            let in_bind = |j: HumanJoint| skeleton.joints_in_bind[skeleton.find(j).unwrap().index()];
            let length = (in_bind(end) - in_bind(joint)).norm();
            greatest = greatest.max((at(joint) + direction * length - at(end)).norm());
        }
    }
    greatest
}

#[test]
fn segments_of_three_rigs_are_within_a_millimetre_of_forward_kinematics() {
    for name in ["walk", "turn", "squat"] {
        let motion = performance(name, 5);
        let rigs = [
            ("T-pose", with_rest(&motion, t_pose), Turn::identity()),
            (
                "A-pose, Z up, decimetres, twist bones",
                placed(&with_rest(&with_twist_bones(&motion), a_pose), &z_up(), 10.0),
                z_up(),
            ),
            ("own axes, centimetres", placed(&with_own_axes(&motion), &Turn::identity(), 100.0), Turn::identity()),
        ];
        for (rig, motion, turn) in rigs {
            let motion = through_bvh(&motion);
            let error = greatest_error(&motion, &followed(motion.clone()), &turn.inverse());
            assert!(error < 1e-3, "{name}, {rig}: {:.3} mm", error * 1e3);
        }
    }
}

#[test]
fn the_rest_pose_of_a_rig_does_not_matter() {
    let motion = performance("squat", 10);
    let expected = followed(motion.clone());
    for (rest, other) in [("T", with_rest(&motion, t_pose)), ("A", with_rest(&motion, a_pose))] {
        for (found, expected) in followed(other).poses.iter().zip(&expected.poses) {
            assert!((found.translation - expected.translation).norm() < 1e-6, "{rest}");
            let skeleton = &figure().skeleton;
            let (a, b) = (skeleton.joints_in_world(found), skeleton.joints_in_world(expected));
            let of_body = a.iter().zip(&b).take(HumanJoint::BODY.len());
            let greatest = of_body.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(greatest < 1e-3, "{rest}-pose: {greatest}");
        }
    }
}

#[test]
fn unit_and_axes_of_a_clip_do_not_matter() {
    let motion = with_rest(&performance("turn", 10), t_pose);
    let expected = followed(motion.clone());
    let y_up_back = Turn::from_axis_angle(&Vec3::y_axis(), std::f64::consts::PI);
    let x_up = Turn::from_axis_angle(&Vec3::z_axis(), -std::f64::consts::FRAC_PI_2);
    for (turn, scale) in [(z_up(), 1.0), (Turn::identity(), 100.0), (z_up(), 39.37), (y_up_back, 10.0), (x_up, 1000.0)]
    {
        let found = followed(placed(&motion, &turn, scale));
        for (found, expected) in found.poses.iter().zip(&expected.poses) {
            assert!((found.translation - expected.translation).norm() < 1e-9, "{turn} {scale}");
            let angle = found.rotations.iter().zip(&expected.rotations).map(|(a, b)| a.angle_to(b)).fold(0.0, f64::max);
            assert!(angle < 1e-6, "{turn} {scale}: {angle}");
        }
    }
}

/// The figure's own skeleton with poses as a motion.
fn motion_of(poses: &[Pose]) -> RawMotion {
    let skeleton = &figure().skeleton;
    let above =
        |j: JointId| skeleton.parents[j.index()].map_or_else(Point::origin, |p| skeleton.joints_in_bind[p.index()]);
    let offset = |j: JointId| skeleton.joints_in_bind[j.index()] - above(j);
    let joints = skeleton.ids().map(|j| RawJoint {
        name: skeleton.names[j.index()].clone(),
        parent: skeleton.parents[j.index()].map(JointId::index),
        rest: RawTransform::translated(offset(j).into()),
        end: None,
    });
    let of = |pose: &Pose, j: JointId| RawTransform {
        translation: (offset(j) + if j.index() == 0 { pose.translation } else { Vec3::zeros() }).into(),
        rotation: pose.rotations[j.index()].into_inner().coords.into(),
    };
    RawMotion {
        name: None,
        joints: joints.collect(),
        frame_secs: Some(1.0 / 30.0),
        frames: poses.iter().map(|pose| skeleton.ids().map(|j| of(pose, j)).collect()).collect(),
        notes: Vec::new(),
    }
}

#[test]
fn a_figures_own_motion_comes_back_as_it_was() {
    let clip = Clip::new("x", performance("squat", 3));
    let track =
        follow(&clip, figure(), None, None, &MotionParams { ease_secs: 0.0, ..MotionParams::default() }).unwrap().0;
    let own = through_bvh(&motion_of(&track.poses));
    // Retargeted alone, and with limits too: the poses are within them.
    for params in [plain(), MotionParams { limits: true, ..plain() }] {
        let back = follow(&Clip::new("own", own.clone()), figure(), None, None, &params).unwrap().0;
        for (found, expected) in back.poses.iter().zip(&track.poses) {
            assert!((found.translation - expected.translation).norm() < 1e-6);
            let angle = found.rotations.iter().zip(&expected.rotations).map(|(a, b)| a.angle_to(b)).fold(0.0, f64::max);
            assert!(angle < 1e-5, "{angle}");
        }
    }
    // Planted again, a foot may touch down one frame earlier or later; nothing else moves.
    let again = follow(
        &Clip::new("own", own),
        figure(),
        None,
        None,
        &MotionParams { ease_secs: 0.0, ..MotionParams::default() },
    );
    let skeleton = &figure().skeleton;
    for (found, expected) in again.unwrap().0.poses.iter().zip(&track.poses) {
        let (a, b) = (skeleton.joints_in_world(found), skeleton.joints_in_world(expected));
        let greatest = a.iter().zip(&b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(greatest < 0.015, "{greatest}");
    }
}

#[test]
fn fingers_turn_as_the_clips_whatever_the_rest_pose_of_its_hands() {
    let skeleton = &figure().skeleton;
    let hands = Side::BOTH.map(|side| HandJoints::find(skeleton, side).unwrap());
    let pose = |share: f64| {
        let mut pose = Pose::bind(skeleton.len());
        let grasp = Grasp { curl: share, spread: 0.3, thumb: 0.5 * share };
        hands.iter().for_each(|hand| hand.apply(&grasp, &mut pose));
        pose
    };
    let poses: Vec<Pose> = (0..5).map(|k| pose(0.2 * f64::from(k))).collect();
    let motion = through_bvh(&motion_of(&poses));
    // A rig whose hands are fists without rotations.
    let turns = skeleton.world_from_bind(&poses[4]);
    let fists = with_rest(&motion, |name| {
        let j = skeleton.ids().find(|&j| skeleton.names[j.index()] == name).unwrap();
        turns[j.index()].rotation
    });
    for motion in [motion, fists] {
        let (track, report) = follow(&Clip::new("x", motion), figure(), None, None, &plain()).unwrap();
        assert!(report.findings.iter().any(|text| text.contains("30 of fingers")), "{:?}", report.findings);
        for (found, expected) in track.poses.iter().zip(&poses) {
            let (a, b) = (skeleton.joints_in_world(found), skeleton.joints_in_world(expected));
            let greatest = a.iter().zip(&b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            assert!(greatest < 1e-3, "{greatest}");
        }
    }
    // Fingers that never turn are not the person's.
    let still = motion_of(&vec![Pose::bind(skeleton.len()); 3]);
    let (_, report) = follow(&Clip::new("x", still), figure(), None, None, &plain()).unwrap();
    assert!(report.findings.iter().all(|text| !text.contains("fingers")), "{:?}", report.findings);
}

#[test]
fn the_hips_travel_as_far_per_leg_as_the_clips() {
    let motion = performance("walk", 1);
    let skeleton = &figure().skeleton;
    let track = followed(motion.clone());
    let leg = |at: &dyn Fn(HumanJoint) -> Vec3| {
        let side = Side::Left;
        (at(HumanJoint::LowerLeg(side)) - at(HumanJoint::UpperLeg(side))).norm()
            + (at(HumanJoint::Foot(side)) - at(HumanJoint::LowerLeg(side))).norm()
    };
    let own = leg(&|j| skeleton.joints_in_bind[skeleton.find(j).unwrap().index()].coords);
    let clips = leg(&|j| world_of(&motion, 0, index_of(&motion, j.name())).translation.vector);
    let way = |first: Vec3, last: Vec3| (last - first).norm();
    let found = way(track.poses[0].translation, track.poses[299].translation) / own;
    let expected =
        way(isometry(&motion.frames[0][0]).translation.vector, isometry(&motion.frames[299][0]).translation.vector)
            / clips;
    assert!((found - expected).abs() < 1e-2 * expected, "{found} {expected}");
}

#[test]
fn frames_are_resampled_and_ranges_cut_out() {
    let clip = Clip::new("x", performance("walk", 1));
    let with =
        |fps, range| follow(&clip, figure(), fps, range, &MotionParams { ease_secs: 0.5, ..MotionParams::default() });
    let (track, _) = with(None, None).unwrap();
    assert_eq!((track.fps, track.lead, track.poses.len(), track.clip_poses().len()), (30.0, 15, 315, 300));
    let double = with(Some(60.0), None).unwrap().0;
    assert_eq!((double.lead, double.clip_poses().len()), (30, 599));
    let part = with(None, Some(FrameRange { from: 100, to: 120 })).unwrap().0;
    // The same motion, but from where the figure stands.
    let whole = &track.clip_poses()[100..120];
    for (k, (cut, pose)) in part.clip_poses().iter().zip(whole).enumerate() {
        assert!(cut.rotations[1..] == pose.rotations[1..]);
        let way = |poses: &[Pose], k: usize| (poses[k].translation - poses[0].translation).norm();
        assert!((way(part.clip_poses(), k) - way(whole, k)).abs() < 1e-9);
        assert!((cut.translation.y - pose.translation.y).abs() < 1e-9);
    }
    let begin = &part.clip_poses()[0];
    assert!(begin.translation.xz().norm() < 1e-9 && heading(&begin.rotations[0]).abs() < 1e-9);
    assert!(whole[0].translation.xz().norm() > 0.5, "which is elsewhere in the clip");
    let lowest = part.poses.iter().map(|pose| pose.translation.y).fold(0.0, f64::min);
    assert!(lowest > -0.15, "the hips sink by {lowest} m: a leap led in");
    assert!(part.poses[0] == Pose::bind(figure().skeleton.len()));
    // 240 frames per second become 60, so that every fourth frame is one of the clip's.
    let mut fast = performance("walk", 1);
    fast.frame_secs = Some(1.0 / 240.0);
    let track = follow(&Clip::new("x", fast), figure(), None, None, &plain()).unwrap().0;
    assert_eq!((track.fps.round(), track.poses.len()), (60.0, 75));
    let none = with(None, Some(FrameRange { from: 290, to: 301 })).unwrap_err();
    assert_eq!(none.to_string(), "the clip has 300 frames at 30 per second: it has no frames 290..301");
}
