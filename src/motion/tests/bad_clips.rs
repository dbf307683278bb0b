//! Clips with faults give a clear sentence or a stable track.

use super::figure;
use super::rigs::{performance, renamed, t_pose, with_rest};
use crate::body::{HumanJoint, Pose, Side};
use crate::formats::RawMotion;
use crate::motion::ground::Ground;
use crate::motion::limits::Anatomy;
use crate::motion::{Clip, MotionParams, MotionReport, PoseTrack, follow};
use nalgebra::{Quaternion, UnitQuaternion};
use proptest::prelude::*;

fn followed(motion: RawMotion) -> (PoseTrack, MotionReport) {
    follow(&Clip::new("x", motion), figure(), None, None, &MotionParams::default()).unwrap()
}

fn is_sound(track: &PoseTrack) {
    let ground = Ground::of(figure());
    let anatomy = Anatomy::new(&figure().skeleton);
    for (frame, pose) in track.poses.iter().enumerate() {
        assert!(pose.translation.iter().all(|x| x.is_finite()), "frame {frame}");
        assert!(pose.rotations.iter().all(|r| (r.norm() - 1.0).abs() < 1e-6), "frame {frame}");
        let world = figure().skeleton.world_from_bind(pose);
        let low = (0..2).map(|s| ground.lowest_of_foot(s, &world)).fold(ground.lowest_of_body(&world), f64::min);
        assert!(low > -1e-4, "frame {frame}: {low}");
        if frame >= track.lead {
            assert_eq!(anatomy.limited(pose).1, 0, "frame {frame} is beyond the limits");
        }
    }
}

#[test]
fn one_frame_is_a_pose_with_a_way_to_it() {
    let mut motion = performance("squat", 1);
    motion.frames = vec![motion.frames[50].clone()];
    let (track, _) = followed(motion);
    assert_eq!((track.poses.len(), track.lead), (31, 30));
    assert!(track.poses[0] == Pose::bind(figure().skeleton.len()));
    is_sound(&track);
}

#[test]
fn a_clip_without_a_frame_time_is_played_at_thirty_frames() {
    let mut motion = performance("walk", 1);
    motion.frame_secs = None;
    let (track, report) = followed(motion);
    assert_eq!(track.fps.round(), 30.0);
    assert!(report.findings.iter().any(|f| f == "30 frames per second are assumed"), "{:?}", report.findings);
}

#[test]
fn a_frame_time_that_no_capture_has_is_replaced() {
    for secs in [1e-12, 1e9] {
        let mut motion = performance("walk", 10);
        motion.frame_secs = Some(secs);
        let (track, report) = followed(motion.clone());
        assert_eq!(track.clip_poses().len(), motion.frames.len());
        assert!(report.findings[0].starts_with("the file states an impossible frame time of 1e"), "{report:?}");
    }
}

#[test]
fn a_root_that_jumps_in_every_frame_is_reported_in_a_few_sentences() {
    let mut motion = performance("idle", 1);
    for frame in motion.frames.iter_mut().step_by(2) {
        frame[0].translation[0] += 40.0;
    }
    let (track, report) = followed(motion);
    let jumps = report.findings.iter().filter(|f| f.contains("jump")).count();
    assert!(jumps == 4 && report.findings.iter().any(|f| f.starts_with("so it does at 296 more frames")), "{report:?}");
    is_sound(&track);
}

#[test]
fn a_forearm_raised_in_a_t_pose_stays_raised() {
    // The elbow of such a rig turns sideways, which no elbow can; the upper arm twists instead.
    let mut motion = with_rest(&performance("idle", 100), t_pose);
    let forearm = motion.joints.iter().position(|joint| joint.name == "leftLowerArm").unwrap();
    let upward = UnitQuaternion::from_axis_angle(&nalgebra::Vector3::z_axis(), 1.2);
    for frame in &mut motion.frames {
        for (transform, joint) in frame.iter_mut().zip(&motion.joints) {
            *transform = joint.rest;
        }
        frame[forearm].rotation = upward.into_inner().coords.into();
    }
    let (track, _) = followed(motion);
    let skeleton = &figure().skeleton;
    for pose in track.clip_poses() {
        let joints = skeleton.joints_in_world(pose);
        let at = |j: HumanJoint| joints[skeleton.find(j).unwrap().index()];
        let forearm = at(HumanJoint::Hand(Side::Left)) - at(HumanJoint::LowerArm(Side::Left));
        let off = forearm.angle(&nalgebra::Vector3::new(1.2f64.cos(), 1.2f64.sin(), 0.0)).to_degrees();
        assert!(off < 12.0, "{off:.0}° off");
    }
    is_sound(&track);
}

#[test]
fn a_root_that_jumps_goes_on_where_it_was() {
    let whole = followed(performance("walk", 1)).0;
    let mut motion = performance("walk", 1);
    for frame in &mut motion.frames[150..] {
        frame[0].translation[0] += 40.0;
        frame[0].translation[2] -= 7.0;
    }
    let (track, report) = followed(motion);
    assert!(report.findings.iter().any(|f| f.starts_with("the whole body jumps by 39.0 m at frame 150")), "{report:?}");
    is_sound(&track);
    let (found, expected) = (&track.poses[329], &whole.poses[329]);
    // The jump's own frame is lost, not more.
    assert!((found.translation - expected.translation).norm() < 0.1, "{} {}", found.translation, expected.translation);
}

#[test]
fn a_start_far_away_and_turned_around_begins_where_the_figure_stands() {
    let turn = UnitQuaternion::from_axis_angle(&nalgebra::Vector3::y_axis(), 2.5);
    let mut motion = performance("walk", 1);
    for frame in &mut motion.frames {
        let root = &mut frame[0];
        let place = turn * nalgebra::Vector3::from(root.translation);
        root.translation = [place.x + 300.0, place.y + 12.0, place.z - 80.0];
        let rotation = turn * UnitQuaternion::new_unchecked(Quaternion::from(root.rotation));
        root.rotation = rotation.into_inner().coords.into();
    }
    let (found, expected) = (followed(motion).0, followed(performance("walk", 1)).0);
    is_sound(&found);
    let skeleton = &figure().skeleton;
    for (a, b) in found.poses.iter().zip(&expected.poses) {
        let (a, b) = (skeleton.joints_in_world(a), skeleton.joints_in_world(b));
        let greatest = a.iter().zip(&b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        // The clip itself begins 3 cm before the place where the figure stands.
        assert!(greatest < 0.035, "{greatest}");
    }
}

#[test]
fn what_is_no_person_is_refused_in_one_sentence() {
    let refused = |motion: RawMotion| {
        let error = follow(&Clip::new("x", motion), figure(), None, None, &MotionParams::default()).unwrap_err();
        assert!(error.hint().is_some());
        error.to_string()
    };
    let keep = |motion: &RawMotion, kept: &dyn Fn(&str) -> bool| {
        let places: Vec<usize> = (0..motion.joints.len()).filter(|&j| kept(&motion.joints[j].name)).collect();
        let new_of = |j: usize| places.iter().position(|&p| p == j);
        let mut part = motion.clone();
        part.joints = places.iter().map(|&j| motion.joints[j].clone()).collect();
        for joint in &mut part.joints {
            joint.parent = joint.parent.and_then(new_of);
        }
        part.frames = motion.frames.iter().map(|frame| places.iter().map(|&j| frame[j]).collect()).collect();
        part
    };
    let whole = performance("idle", 60);
    let no_legs = keep(&whole, &|name| !name.contains("Leg") && !name.contains("Foot") && !name.contains("Toes"));
    assert!(refused(no_legs).starts_with("the clip's 14 joints do not form a person: it has fewer than five chains"));
    let tail = keep(&whole, &|name| name == "hips" || name == "spine");
    assert!(refused(tail).contains("do not form a person"));
    let mut points = renamed(&whole, |_, name| name.to_string());
    points.joints.iter_mut().for_each(|joint| joint.rest.translation = [0.0; 3]);
    points.frames.iter_mut().flatten().for_each(|t| t.translation = [0.0; 3]);
    assert_eq!(refused(points), "the legs of the clip's skeleton are 0 units long in frame 0, so its size is unknown");
    let mut huge = whole.clone();
    huge.frames[2][0].translation[1] = 1e300;
    assert_eq!(refused(huge), "frame 2 of the clip places a joint at no finite position");
    let mut slow = whole;
    slow.frame_secs = Some(10.0);
    let error = follow(&Clip::new("x", slow), figure(), Some(1e5), None, &MotionParams::default()).unwrap_err();
    assert!(error.to_string().ends_with("frames are too many: a track has at most 108000"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn any_rotations_give_a_sound_track_within_the_limits(
        angles in prop::collection::vec(prop::array::uniform3(-3.0f64..3.0), 22 * 3),
    ) {
        let mut motion = performance("idle", 100);
        for (frame, t) in motion.frames.iter_mut().zip(angles.chunks(22)) {
            for (transform, vector) in frame.iter_mut().zip(t).skip(1) {
                let rotation = UnitQuaternion::from_scaled_axis(nalgebra::Vector3::from(*vector) * 0.6);
                transform.rotation = rotation.into_inner().coords.into();
            }
        }
        is_sound(&followed(motion).0);
    }

    #[test]
    fn limits_change_nothing_twice(angles in prop::collection::vec(prop::array::uniform3(-3.0f64..3.0), 22)) {
        let anatomy = Anatomy::new(&figure().skeleton);
        let mut pose = Pose::bind(22);
        for (rotation, vector) in pose.rotations.iter_mut().zip(&angles) {
            *rotation = UnitQuaternion::from_scaled_axis(nalgebra::Vector3::from(*vector));
        }
        let (once, _) = anatomy.limited(&pose);
        let (twice, beyond) = anatomy.limited(&once);
        let off: Vec<_> = figure().skeleton.ids().filter(|&j| anatomy.limited_joint(&once, j).is_some()).collect();
        prop_assert_eq!(beyond, 0, "{:?}", off.iter().map(|j| HumanJoint::BODY[j.index()]).collect::<Vec<_>>());
        for (k, (a, b)) in once.rotations.iter().zip(&twice.rotations).enumerate() {
            prop_assert!(a.angle_to(b) < 1e-6, "{:?}", HumanJoint::BODY[k]);
        }
    }
}
