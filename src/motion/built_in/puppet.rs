//! The skeleton on which our clips are made: that of an average adult, in the neutral pose.

use crate::body::HumanJoint::{
    self, Chest, Foot, Hand, Head, Hips, LowerArm, LowerLeg, Neck, Shoulder, Spine, Toes, UpperArm, UpperChest,
    UpperLeg,
};
use crate::body::Side::{self, Left, Right};
use crate::body::{JointId, Pose, Skeleton};
use crate::formats::{RawJoint, RawMotion, RawTransform};
use crate::geometry::{Point, Vec3};
use crate::motion::aligned::about_vertical;
use crate::motion::leg::Leg;
use nalgebra::{Isometry3, UnitQuaternion};

type Turn = UnitQuaternion<f64>;

/// Frames of each clip.
pub(super) const FRAMES: usize = 300;
/// Frames per second of each clip.
pub(super) const FPS: f64 = 30.0;

/// Stature in metres.
const STATURE: f64 = 1.70;
/// Height of the ankle: Drillis and Contini's 0.039 of stature.
pub(super) const ANKLE: f64 = 0.039 * STATURE;
/// Half of the distance between the hip joints; 17 cm in adults.
pub(super) const HALF_HIPS: f64 = 0.05 * STATURE;
/// From the ankle to the lowest point of the heel and of the ball, forward and down.
pub(super) const HEEL: Vec3 = Vec3::new(0.0, -ANKLE, -0.045);
pub(super) const BALL: Vec3 = Vec3::new(0.0, -ANKLE, 0.115);

/// Where a joint is in the neutral pose: fractions of stature after Drillis and Contini 1966 (thigh 0.245, shank 0.246, upper
/// arm 0.186, forearm 0.146, hip 0.530, shoulder 0.818).
fn neutral(joint: HumanJoint) -> Point {
    let at = |x: f64, y: f64, z: f64| Point::new(x * STATURE, y * STATURE, z);
    let (leg, arm) = (HALF_HIPS / STATURE, 0.105);
    match joint {
        Hips => at(0.0, 0.555, 0.0),
        Spine => at(0.0, 0.60, -0.01),
        Chest => at(0.0, 0.67, -0.02),
        UpperChest => at(0.0, 0.74, -0.02),
        Neck => at(0.0, 0.85, -0.01),
        Head => at(0.0, 0.91, 0.01),
        Shoulder(side) => at(0.015 * side.sign(), 0.82, 0.01),
        UpperArm(side) => at(arm * side.sign(), 0.81, -0.01),
        LowerArm(side) => at(arm * side.sign(), 0.81 - 0.186, -0.01),
        Hand(side) => at(arm * side.sign(), 0.81 - 0.186 - 0.146, -0.01),
        UpperLeg(side) => at(leg * side.sign(), 0.53, 0.0),
        LowerLeg(side) => at(leg * side.sign(), 0.53 - 0.245, 0.0),
        Foot(side) => at(leg * side.sign(), 0.039, 0.0),
        Toes(side) => at(leg * side.sign(), 0.012, 0.115),
    }
}

/// The skeleton in the neutral pose, which is its bind pose: a joint's rotation is anatomical, flexion about x, abduction about
/// z, twist about y.
pub(super) fn skeleton() -> Skeleton {
    Skeleton {
        names: Skeleton::body_names(),
        parents: Skeleton::body_parents(),
        joints_in_bind: HumanJoint::BODY.into_iter().map(neutral).collect(),
    }
}

/// A motion of that skeleton.
pub(super) fn motion(name: &str, poses: &[Pose]) -> RawMotion {
    let skeleton = skeleton();
    let above =
        |j: JointId| skeleton.parents[j.index()].map_or_else(Point::origin, |p| skeleton.joints_in_bind[p.index()]);
    let offset = |j: JointId| <[f64; 3]>::from(skeleton.joints_in_bind[j.index()] - above(j));
    let joints = skeleton
        .ids()
        .map(|j| RawJoint {
            name: skeleton.names[j.index()].clone(),
            parent: skeleton.parents[j.index()].map(JointId::index),
            rest: RawTransform::translated(offset(j)),
            end: None,
        })
        .collect();
    let frame = |pose: &Pose| {
        let of = |j: JointId| {
            let moved = if j.index() == 0 { pose.translation } else { Vec3::zeros() };
            RawTransform {
                translation: (Vec3::from(offset(j)) + moved).into(),
                rotation: pose.rotations[j.index()].into_inner().coords.into(),
            }
        };
        skeleton.ids().map(of).collect()
    };
    RawMotion {
        name: Some(name.into()),
        joints,
        frame_secs: Some(1.0 / FPS),
        frames: poses.iter().map(frame).collect(),
        notes: Vec::new(),
    }
}

/// A pose in the making.
pub(super) struct Puppet {
    skeleton: Skeleton,
    legs: [Leg; 2],
    pub pose: Pose,
}

impl Puppet {
    /// In the neutral pose.
    pub fn new() -> Self {
        let skeleton = skeleton();
        // The skeleton above has both legs.
        let legs = Side::BOTH.map(|side| Leg::of(&skeleton, side).expect("the puppet has legs"));
        let pose = Pose::bind(skeleton.len());
        Self { skeleton, legs, pose }
    }

    /// Sets a joint's rotation: degrees about x, then z, then y.
    pub fn turn(&mut self, joint: HumanJoint, [x, y, z]: [f64; 3]) {
        let Some(j) = self.skeleton.find(joint) else { return };
        let about = |axis: nalgebra::Unit<Vec3>, degrees: f64| Turn::from_axis_angle(&axis, degrees.to_radians());
        self.pose.rotations[j.index()] = about(Vec3::y_axis(), y) * about(Vec3::z_axis(), z) * about(Vec3::x_axis(), x);
    }

    /// A joint of a side, with angles as for the left.
    pub fn turn_side(&mut self, joint: fn(Side) -> HumanJoint, side: Side, [x, y, z]: [f64; 3]) {
        self.turn(joint(side), [x, y * side.sign(), z * side.sign()]);
    }

    /// An arm: degrees of flexion, abduction and inward twist of the shoulder, and flexion of the elbow.
    pub fn arm(&mut self, side: Side, flexion: f64, abduction: f64, inward: f64, elbow: f64) {
        let [x, z] = [-flexion, abduction * side.sign()].map(f64::to_radians);
        // The direction does not depend on an order of the two; the twist is about the arm itself.
        let swing = Turn::from_scaled_axis(Vec3::new(x, 0.0, z));
        let twist = about_vertical((-inward * side.sign()).to_radians());
        if let Some(j) = self.skeleton.find(UpperArm(side)) {
            self.pose.rotations[j.index()] = swing * twist;
        }
        self.turn_side(LowerArm, side, [-elbow, 0.0, 0.0]);
    }

    /// Bends the trunk: degrees about x, y and z, shared by its joints.
    pub fn trunk(&mut self, degrees: [f64; 3]) {
        for (joint, share) in [(Spine, 0.5), (Chest, 0.3), (UpperChest, 0.2)] {
            self.turn(joint, degrees.map(|d| d * share));
        }
    }

    /// Turns neck and head, half each.
    pub fn gaze(&mut self, degrees: [f64; 3]) {
        self.turn(Neck, degrees.map(|d| 0.5 * d));
        self.turn(Head, degrees.map(|d| 0.5 * d));
    }

    /// Places the hips: their rotation, and the middle of the hip joints.
    pub fn hips(&mut self, rotation: Turn, middle: Point) {
        let at = |joint| neutral(joint);
        let in_bind = nalgebra::center(&at(UpperLeg(Left)), &at(UpperLeg(Right)));
        self.pose.rotations[0] = rotation;
        let root = at(Hips);
        self.pose.translation = middle - rotation * (in_bind - root) - root;
    }

    /// Places a foot: the ankle and the rotation; the knee points where the thigh's twist says, `outward` degrees.
    pub fn foot(&mut self, side: Side, ankle: &Point, rotation: &Turn, outward: f64) {
        // A slight bend gives the knee its direction.
        let lift = -30.0;
        self.turn_side(UpperLeg, side, [lift, outward, 0.0]);
        self.turn_side(LowerLeg, side, [-2.0 * lift, 0.0, 0.0]);
        let leg = &self.legs[usize::from(side == Right)];
        leg.reach(&self.skeleton, &mut self.pose, ankle, rotation, Some(rotation));
    }

    /// `world_from_bind` of every joint.
    pub fn world(&self) -> Vec<Isometry3<f64>> {
        self.skeleton.world_from_bind(&self.pose)
    }

    /// Heel and ball of a foot in the world.
    pub fn sole(&self, world: &[Isometry3<f64>], side: Side) -> [Point; 2] {
        let foot = world[self.legs[usize::from(side == Right)].foot.index()];
        [HEEL, BALL].map(|offset| foot * (neutral(Foot(side)) + offset))
    }
}
