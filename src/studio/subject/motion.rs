//! The stances of a subject: how people stand a little differently in each scan, and sway within one.

use super::person::Subject;
use super::stance::ScanStance;
use crate::body::{Grasp, HandJoints, HumanJoint, Pose, Side};
use crate::geometry::Vec3;
use crate::numerics::Rng;
use nalgebra::{Isometry3, UnitQuaternion};

/// Breathing expands the chest by at most this, metres (quiet breathing: 2–5 mm).
const BREATH: f64 = 0.0025;
/// Standard deviation of a joint between two scans, radians (2°).
const JOINT_DEVIATION: f64 = 0.035;

impl Subject {
    /// The stance in step `step` of the session of a seed: arms, trunk and legs differ a little in each.
    pub fn stance(&self, seed: u64, step: usize) -> ScanStance {
        let mut rng = Rng::new(seed.wrapping_mul(31).wrapping_add(step as u64 + 1));
        let mut pose = Pose::bind(self.skeleton.len());
        for (joint, rotation) in self.skeleton.ids().zip(&mut pose.rotations) {
            if self.skeleton.is_finger(joint) {
                continue;
            }
            let part = self.part_of(joint);
            let stiff =
                if matches!(part, HumanJoint::Hips | HumanJoint::Foot(_) | HumanJoint::Toes(_)) { 0.15 } else { 1.0 };
            let is_trunk = matches!(part, HumanJoint::Spine | HumanJoint::Chest | HumanJoint::UpperChest);
            let trunk = if is_trunk { 0.5 } else { 1.0 };
            let axis = Vec3::new(rng.normal(), rng.normal(), rng.normal()) * (JOINT_DEVIATION * stiff * trunk);
            *rotation = UnitQuaternion::from_scaled_axis(axis);
        }
        // Legs move less, or the feet would leave the ground.
        for side in Side::BOTH {
            for joint in [HumanJoint::LowerLeg(side), HumanJoint::UpperLeg(side)] {
                let rotation = &mut pose.rotations[self.joint(joint).index()];
                *rotation = UnitQuaternion::identity().slerp(rotation, 0.4);
            }
        }
        let heading = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), rng.between(-0.2, 0.2));
        let at = Vec3::new(rng.between(-0.03, 0.03), 0.0, rng.between(-0.03, 0.03));
        ScanStance {
            pose,
            breath: BREATH * rng.between(-1.0, 1.0),
            file_from_world: Isometry3::from_parts(at.into(), heading),
        }
    }

    /// `pose` at `time` (−½ to ½) of a turn in which the arms sink: by 2.5° per centimetre of sway.
    pub fn with_sinking_arms(&self, pose: &Pose, sway: f64, time: f64) -> Pose {
        let down = Vec3::z() * (2.5f64.to_radians() * (sway / 0.01) * time);
        self.turned(pose, &[(HumanJoint::UpperArm(Side::Left), -down), (HumanJoint::UpperArm(Side::Right), down)])
    }

    /// `pose` with joints turned by rotation vectors (radians) about the axes of the bind pose.
    pub fn turned(&self, pose: &Pose, turns: &[(HumanJoint, Vec3)]) -> Pose {
        let mut turned = pose.clone();
        for &(joint, turn) in turns {
            let rotation = &mut turned.rotations[self.joint(joint).index()];
            *rotation = UnitQuaternion::from_scaled_axis(turn) * *rotation;
        }
        turned
    }

    /// Sets the finger joints of both hands; nothing on a skeleton without them.
    pub fn apply_grasp(&self, grasp: &Grasp, pose: &mut Pose) {
        let hands = Side::BOTH.into_iter().filter_map(|side| HandJoints::find(&self.skeleton, side));
        hands.for_each(|hand| hand.apply(grasp, pose));
    }

    /// The lean at `time` of a turn: metres sideways per metre of height, at most `sway` metres at the crown.
    pub fn lean(&self, sway: f64, time: f64, seed: u64) -> Vec3 {
        let mut rng = Rng::new(seed ^ 0x5EA5);
        let stature = self.surface.bounds().map_or(1.7, |b| b.extent().y);
        let mut wave = || {
            let (slow, quick) = (rng.unit(), rng.unit());
            // A drift of under one period, and a quicker swing: two thirds and one third.
            move |t: f64| 0.67 * ((t + slow) * 5.0).sin() + 0.33 * ((t + quick) * 17.0).sin()
        };
        let (x, z) = (wave(), wave());
        Vec3::new(x(time), 0.0, z(time)) * (sway / stature / std::f64::consts::SQRT_2)
    }

    /// The bind pose, without breath, in its own frame.
    pub fn at_rest(&self) -> ScanStance {
        ScanStance { pose: Pose::bind(self.skeleton.len()), breath: 0.0, file_from_world: Isometry3::identity() }
    }
}
