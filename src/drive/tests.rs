//! Laws of the player and of the Laplacian body, on the embedded body and its own joints.

use super::calibration::{StreamKind, calibrate};
use super::landmark::{Landmark, LandmarkFrame, Places};
use super::laplacian::{FrameUpdate, LaplacianBody, RightSide};
use super::player::{KeyPoses, PlayedFrame, Player};
use super::stream::Smoothing;
use super::transfer::Between;
use crate::body::{Figure, HumanJoint, Pose, Side, embedded_model};
use crate::geometry::{Point, Vec3};
use nalgebra::{Rotation3, UnitQuaternion};

const RATE: f64 = 30.0;
/// Seconds in which the figure stands, and then raises an arm.
const STANDS: f64 = 2.5;
const MOVES: f64 = 1.0;

fn figure() -> Figure {
    let model = embedded_model().unwrap();
    Figure::mean(&model)
}

/// The left arm raised by an angle, and the elbow bent by as much.
fn raised(figure: &Figure, angle: f64) -> Pose {
    let mut pose = Pose::bind(figure.skeleton.len());
    for joint in [HumanJoint::UpperArm(Side::Left), HumanJoint::LowerArm(Side::Left)] {
        let at = figure.skeleton.find(joint).unwrap();
        pose.rotations[at.index()] = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), angle);
    }
    pose
}

/// The sixteen landmarks at the joints of a pose.
fn places(figure: &Figure, pose: &Pose) -> Places {
    let joints = figure.skeleton.joints_in_world(pose);
    std::array::from_fn(|k| {
        let landmark = Landmark::ALL[k];
        let is_end = matches!(landmark, Landmark::Hand(_) | Landmark::Toe(_));
        figure.skeleton.find(landmark.joint()).filter(|_| !is_end).map(|j| joints[j.index()])
    })
}

/// A stream of somebody who stands still and then raises an arm by half a radian, shown by `seen`.
fn stream(figure: &Figure, seen: impl Fn(Point) -> Point) -> Vec<(Pose, LandmarkFrame)> {
    let frames = ((STANDS + MOVES) * RATE) as usize;
    (0..frames)
        .map(|k| {
            let secs = k as f64 / RATE;
            let pose = raised(figure, 0.5 * ((secs - STANDS) / MOVES).clamp(0.0, 1.0));
            let places = places(figure, &pose).map(|place| place.map(&seen));
            (pose, LandmarkFrame { secs, places })
        })
        .collect()
}

const RAW: Smoothing = Smoothing { min_cutoff_hz: 0.0, beta: 0.0, bridge_secs: 0.0 };

fn kind() -> StreamKind {
    StreamKind { are_joint_centres: true, ..StreamKind::default() }
}

fn played(mut player: Player, stream: &[(Pose, LandmarkFrame)]) -> Vec<PlayedFrame> {
    let mut frames = Vec::new();
    for (_, frame) in stream {
        frames.extend(player.push(frame.clone()).unwrap());
    }
    frames.extend(player.end().unwrap());
    assert_eq!(player.counts().frames, frames.len());
    frames
}

#[test]
fn inverse_kinematics_plays_every_frame_and_follows_the_joints() {
    let figure = figure();
    let stream = stream(&figure, |p| p);
    let frames = played(Player::new(&figure, kind(), Some(RAW)), &stream);
    assert_eq!(frames.len(), stream.len(), "frames from before the calibration are played, too");
    for (frame, (pose, _)) in frames.iter().zip(&stream) {
        let (own, truth) = (figure.skeleton.joints_in_world(&frame.pose), figure.skeleton.joints_in_world(pose));
        let of_body = own.iter().zip(&truth).take(HumanJoint::BODY.len());
        let worst = of_body.map(|(p, q)| (p - q).norm()).fold(0.0, f64::max);
        assert!(worst < 0.03, "{worst} m at {} s", frame.secs);
    }
}

#[test]
fn a_wearer_who_is_taller_and_stands_elsewhere_moves_the_figure_alike() {
    let figure = figure();
    let (turn, shift) = (Rotation3::from_axis_angle(&Vec3::y_axis(), 0.7), Vec3::new(1.5, 0.0, -2.0));
    let bent = |frame: &PlayedFrame| {
        let elbow = figure.skeleton.find(HumanJoint::LowerArm(Side::Left)).unwrap();
        frame.pose.rotations[elbow.index()].angle()
    };
    let own = played(Player::new(&figure, kind(), Some(RAW)), &stream(&figure, |p| p));
    let seen = stream(&figure, |p| turn * (p * 1.15) + shift);
    let moved = played(Player::new(&figure, kind(), Some(RAW)), &seen);
    let (a, b) = (bent(own.last().unwrap()), bent(moved.last().unwrap()));
    assert!((a - b).abs() < 0.1 && a > 0.3, "{a} {b}");
}

#[test]
fn a_stream_without_a_pose_to_begin_from_plays_nothing_and_says_why() {
    let figure = figure();
    let mut player = Player::new(&figure, kind(), None);
    for (_, frame) in stream(&figure, |p| p).iter().take(20) {
        assert!(player.push(frame.clone()).unwrap().is_empty());
    }
    let refused = player.end().unwrap_err().to_string();
    assert!(!refused.is_empty() && player.calibration().is_none());
}

#[test]
fn frames_between_key_poses_come_with_the_next_and_none_is_lost() {
    let figure = figure();
    let stream = stream(&figure, |p| p);
    let library = super::embedded_library().unwrap();
    let keys = KeyPoses { interval_secs: 0.2, between: Between::Rotations };
    let frames = played(Player::new(&figure, kind(), Some(RAW)).by_laplacian(library, keys), &stream);
    assert_eq!(frames.len(), stream.len());
    assert!(frames.windows(2).all(|pair| pair[0].secs < pair[1].secs), "in their order");
    assert!(frames.iter().all(|frame| frame.solved.is_some() && frame.distance < 0.05));
}

#[test]
fn the_laplacian_body_at_rest_stays_and_moves_rigidly_with_its_landmarks() {
    let figure = figure();
    let stream = stream(&figure, |p| p);
    let still: Places = stream[0].1.places;
    let calibration = calibrate(&figure, &still, 0.0, kind()).unwrap();
    let body = LaplacianBody::prepare(&figure, &calibration.attached, RightSide::default(), FrameUpdate::default());
    let body = body.unwrap();
    let rest: Vec<Vec3> = figure.body().mesh.points().iter().map(|p| p.coords).collect();
    let none = vec![Rotation3::identity(); rest.len()];
    // Where the landmarks of a body at rest are, offsets from the skin included.
    let own: Places = std::array::from_fn(|k| calibration.attached.points_in_bind.0.get(k).copied());
    let solved = body.solve(&own, &calibration.known, &none, &rest, 20, 1e-5);
    let worst = |points: &[Point], truth: &[Vec3]| {
        points.iter().zip(truth).map(|(p, q)| (p.coords - q).norm()).fold(0.0, f64::max)
    };
    let at_rest = worst(solved.points.as_slice(), &rest);
    assert!(at_rest < 1e-4, "{at_rest}");
    // From where the recogniser's template would stand: turned and moved.
    let (turn, shift) = (Rotation3::from_axis_angle(&Vec3::y_axis(), 0.6), Vec3::new(0.4, 0.1, -0.3));
    let there: Vec<Vec3> = rest.iter().map(|p| turn * p + shift).collect();
    let seen = own.map(|place| place.map(|p| Point::from(turn * p.coords + shift)));
    let turned = vec![turn; rest.len()];
    let solved = body.solve(&seen, &calibration.known, &turned, &there, 20, 1e-5);
    let moved = worst(solved.points.as_slice(), &there);
    assert!(moved < 1e-4, "{moved}");
}
