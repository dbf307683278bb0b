//! Our clips on the mean body: feet do not slide, nothing is below the floor, joints stay within human limits, arms outside the
//! body, and every frame follows smoothly from the one before.

use super::figure;
use crate::body::HumanJoint::{self, Foot, Hand, LowerArm, LowerLeg, Toes, UpperArm, UpperLeg};
use crate::body::{Limb, Pose, Side};
use crate::geometry::{PerFace, Point, WindingField};
use crate::motion::ground::Ground;
use crate::motion::{BUILT_IN_CLIPS, MotionParams, PoseTrack, built_in_clip, follow};
use rayon::prelude::*;

fn track(name: &str) -> PoseTrack {
    follow(&built_in_clip(name).unwrap(), figure(), None, None, &MotionParams::default()).unwrap().0
}

/// The vertices of a foot in each pose.
fn foot_vertices(track: &PoseTrack, side: Side) -> Vec<Vec<Point>> {
    let figure = figure();
    let is_foot = |row: &crate::body::SkinRow| matches!(figure.skeleton.human_joint(row[0].0), Some(Foot(s) | Toes(s)) if s == side);
    let rows = figure.body().weights.rows();
    let posed: Vec<_> = track.poses.par_iter().map(|pose| figure.posed(pose).remove(0)).collect();
    posed
        .iter()
        .map(|mesh| mesh.points().iter().zip(rows.iter()).filter(|(_, row)| is_foot(row)).map(|(p, _)| *p).collect())
        .collect()
}

/// How far what touches the floor moves over it, from touch-down to lift-off, step by step in metres. What is within 2 mm of
/// the floor in two frames touches it.
fn slides(frames: &[Vec<Point>], floor: f64) -> Vec<f64> {
    let mut slides = vec![0.0];
    for pair in frames.windows(2) {
        let touching: Vec<f64> = pair[0]
            .iter()
            .zip(&pair[1])
            .filter(|(a, b)| a.y.max(b.y) < floor + 0.002)
            .map(|(a, b)| (b - a).xz().norm())
            .collect();
        match touching.len() {
            0 => slides.push(0.0),
            count => *slides.last_mut().unwrap() += touching.iter().sum::<f64>() / count as f64,
        }
    }
    slides
}

#[test]
fn feet_do_not_slide() {
    let floor = Ground::of(figure()).floor;
    for name in BUILT_IN_CLIPS {
        let track = track(name);
        let mut steps = 0;
        for side in Side::BOTH {
            let of_clip = foot_vertices(&track, side).split_off(track.lead);
            let slides = slides(&of_clip, floor);
            let greatest = slides.iter().copied().fold(0.0, f64::max);
            let shown: Vec<_> = slides.iter().map(|s| format!("{:.1}", s * 1e3)).collect();
            assert!(greatest < 0.01, "{name}, {side:?}: {shown:?} mm");
            steps += slides.iter().filter(|s| **s > 0.0).count();
        }
        if name == "walk" {
            assert!(steps >= 16, "{steps} steps, so feet hardly touched the floor");
        }
    }
}

#[test]
fn nothing_is_below_the_floor_and_something_is_on_it() {
    let floor = Ground::of(figure()).floor;
    for name in BUILT_IN_CLIPS {
        let track = track(name);
        let low =
            |pose: &Pose| figure().posed(pose)[0].points().iter().map(|p| p.y).fold(f64::INFINITY, f64::min) - floor;
        let lows: Vec<f64> = track.poses.par_iter().map(low).collect();
        for (frame, low) in lows.iter().enumerate() {
            // For a frame or two, one foot has left the floor and the other has not quite reached it.
            assert!((-1e-4..6e-3).contains(low), "{name}, frame {frame}: {:.2} mm", low * 1e3);
        }
    }
}

/// Signed flexion of a hinge in degrees, from positions alone; `forward` is where the person looks.
fn flexion(joints: &[Point], [upper, middle, end]: [HumanJoint; 3], across: &crate::geometry::Vec3) -> f64 {
    let at = |j: HumanJoint| joints[figure().skeleton.find(j).unwrap().index()];
    let (a, b) = (at(middle) - at(upper), at(end) - at(middle));
    let angle = a.cross(&b).norm().atan2(a.dot(&b)).to_degrees();
    angle * a.cross(&b).dot(across).signum()
}

#[test]
fn knees_and_elbows_bend_the_way_they_can() {
    let skeleton = &figure().skeleton;
    for name in BUILT_IN_CLIPS {
        for (frame, pose) in track(name).poses.iter().enumerate() {
            let joints = skeleton.joints_in_world(pose);
            let turns = skeleton.world_from_bind(pose);
            for side in Side::BOTH {
                // The knee's axis turns with the thigh, which is straight down in the bind pose, more or less.
                let thigh = turns[skeleton.find(UpperLeg(side)).unwrap().index()].rotation;
                let knee = flexion(
                    &joints,
                    [UpperLeg(side), LowerLeg(side), Foot(side)],
                    &(thigh * crate::geometry::Vec3::x()),
                );
                assert!((-5.0..=150.0).contains(&knee), "{name}, frame {frame}, {side:?}: knee {knee:.0}°");
                let at = |j: HumanJoint| joints[skeleton.find(j).unwrap().index()];
                let (a, b) = (at(LowerArm(side)) - at(UpperArm(side)), at(Hand(side)) - at(LowerArm(side)));
                let elbow = a.angle(&b).to_degrees();
                assert!(elbow <= 150.0, "{name}, frame {frame}, {side:?}: elbow {elbow:.0}°");
            }
        }
    }
}

#[test]
fn arms_stay_outside_the_body() {
    let figure = figure();
    let limbs = Limb::of_joints(&figure.skeleton);
    let rows = figure.body().weights.rows();
    let limb_of = |v: usize| limbs[rows.0[v][0].0.index()];
    let is_arm = |limb: Limb| matches!(limb, Limb::Arm(_));
    let rest: PerFace<bool> =
        figure.body().mesh.faces().iter().map(|f| f.iter().all(|v| !is_arm(limb_of(v.index())))).collect();
    let hands: Vec<usize> = (0..rows.len())
        .filter(|&v| matches!(figure.skeleton.human_joint(rows.0[v][0].0), Some(Hand(_) | LowerArm(_))))
        .step_by(7)
        .collect();
    for name in BUILT_IN_CLIPS {
        let track = track(name);
        let frames: Vec<usize> = (track.lead..track.poses.len()).step_by(6).collect();
        let inside: Vec<(usize, usize)> = frames
            .par_iter()
            .map(|&frame| {
                let mesh = figure.posed(&track.poses[frame]).remove(0);
                let field = WindingField::prepare(&mesh.part(&rest).0);
                (frame, hands.iter().filter(|&&v| field.winding(&mesh.points().0[v]) > 0.5).count())
            })
            .filter(|(_, count)| *count > 0)
            .collect();
        assert!(inside.is_empty(), "{name}: frames with vertices of arms inside the body: {inside:?}");
    }
}

#[test]
fn every_frame_follows_smoothly_from_the_one_before() {
    let skeleton = &figure().skeleton;
    for name in BUILT_IN_CLIPS {
        let track = track(name);
        let places: Vec<Vec<Point>> = track.poses.iter().map(|pose| skeleton.joints_in_world(pose)).collect();
        for (frame, w) in places.windows(3).enumerate() {
            for (j, name_of_joint) in skeleton.names.iter().enumerate() {
                let jolt = (w[2][j] - w[1][j]) - (w[1][j] - w[0][j]);
                let acceleration = jolt.norm() * track.fps * track.fps;
                // A kicking foot makes 60 m/s², a heel strike 90.
                assert!(acceleration < 110.0, "{name}, frame {frame}, {name_of_joint}: {acceleration:.0} m/s²");
            }
        }
    }
}

#[test]
fn ten_thousand_frames_hold_no_nan() {
    let figure = figure();
    let mut count = 0;
    for name in BUILT_IN_CLIPS {
        let params = MotionParams::default();
        let (track, _) = follow(&built_in_clip(name).unwrap(), figure, Some(240.0), None, &params).unwrap();
        count += track.poses.len();
        let is_finite = |pose: &Pose| {
            let transforms = figure.skeleton.world_from_bind(pose);
            transforms.iter().all(|t| t.to_homogeneous().iter().all(|x| x.is_finite()))
        };
        assert!(track.poses.par_iter().all(is_finite), "{name}");
        // Skinning blends those transforms, so a sample of the surfaces suffices.
        let surfaces = track.poses.par_iter().step_by(16).map(|pose| figure.posed(pose).remove(0));
        assert!(surfaces.all(|mesh| mesh.points().iter().all(|p| p.coords.iter().all(|x| x.is_finite()))), "{name}");
    }
    assert!(count > 10_000, "{count}");
}

#[test]
fn one_thread_gives_the_same_bytes() {
    let clip = built_in_clip("walk").unwrap();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| follow(&clip, figure(), None, None, &MotionParams::default()).unwrap().0)
    };
    assert!(with(1) == with(4));
}
