//! Limits of the joints, in anatomical terms.
//!
//! A joint's rotation is measured from the neutral pose: upright, arms and legs straight down, feet level. There, flexion is
//! about x, abduction about z and twist about y, for the trunk as for every limb; those of the right side are mirrored.
//!
//! Before anything is cut off, rotations that the body shares between joints are shared: an elbow or knee that bends sideways
//! turns the upper arm or thigh about its own axis, so that the bend is about the hinge and every segment keeps its
//! direction; a twist of the wrist goes to the forearm; the trunk and the neck bend in all their joints.
//!
//! **Source** AAOS, Boone and Azen 1979, VA 38 CFR 4.71, plus about 10 %.

use super::aligned::{aligned, bone_end};
use crate::body::HumanJoint::{
    self, Chest, Foot, Hand, Head, Hips, LowerArm, LowerLeg, Neck, Shoulder, Spine, Toes, UpperArm, UpperChest,
    UpperLeg,
};
use crate::body::Side::{self, Right};
use crate::body::{JointId, Pose, Skeleton};
use crate::geometry::Vec3;
use crate::numerics::wrapped_angle;
use nalgebra::{Quaternion, Unit, UnitQuaternion};

type Turn = UnitQuaternion<f64>;

/// Least and greatest angle, in degrees.
type Range = (f64, f64);

/// Sideways bend of an elbow or knee beyond which it is turned into a twist of the part above, in degrees: the carrying angle
/// of an elbow is 5 to 15°.
const HINGE_SIDEWAYS_DEG: f64 = 10.0;
/// The greatest twist that this may need, in degrees: beyond it the data bend the joint backwards, and it is straightened.
/// Rigs in a T-pose raise a forearm by turning the elbow sideways, so arms allow more than a right angle.
const GREATEST_TRANSFER_DEG: [f64; 2] = [110.0, 75.0];
/// Twist of the wrist beyond which it is that of the forearm, in degrees: radius and ulna turn, the wrist hardly does.
const WRIST_TWIST_DEG: f64 = 15.0;
/// An upper arm raised beyond this has no definite twist, in degrees: the limit of the twist fades out up to 160°.
const TWIST_FADES_FROM_DEG: f64 = 110.0;

/// Limits of a joint of the left side: about x (negative is flexion of hip, elbow and shoulder), y and z.
fn box_of(joint: HumanJoint) -> Option<[Range; 3]> {
    Some(match joint {
        Hips | UpperArm(_) => return None,
        // 80 / 30 of flexion and extension, 35 sideways, 45 about the axis, shared as 50, 30 and 20 %.
        Spine => [(-15.0, 40.0), (-23.0, 23.0), (-18.0, 18.0)],
        Chest => [(-9.0, 24.0), (-18.0, 18.0), (-12.0, 12.0)],
        UpperChest => [(-6.0, 16.0), (-18.0, 18.0), (-10.0, 10.0)],
        Neck | Head => [(-30.0, 30.0), (-40.0, 40.0), (-23.0, 23.0)],
        Shoulder(_) => [(-15.0, 15.0), (-20.0, 20.0), (-10.0, 40.0)],
        LowerArm(_) => [(-150.0, 5.0), (-90.0, 90.0), (-HINGE_SIDEWAYS_DEG, HINGE_SIDEWAYS_DEG)],
        Hand(_) => [(-45.0, 45.0), (-WRIST_TWIST_DEG, WRIST_TWIST_DEG), (-85.0, 80.0)],
        UpperLeg(_) => [(-130.0, 30.0), (-45.0, 60.0), (-30.0, 50.0)],
        LowerLeg(_) => [(-5.0, 150.0), (-30.0, 30.0), (-HINGE_SIDEWAYS_DEG, HINGE_SIDEWAYS_DEG)],
        Foot(_) => [(-25.0, 55.0), (-25.0, 25.0), (-35.0, 35.0)],
        Toes(_) => [(-80.0, 40.0), (-10.0, 10.0), (-10.0, 10.0)],
    })
}

/// The joints that share the rotation of the trunk, and of neck and head, with their shares.
const SHARED: [&[(HumanJoint, f64)]; 2] =
    [&[(Spine, 0.5), (Chest, 0.3), (UpperChest, 0.2)], &[(Neck, 0.5), (Head, 0.5)]];

/// The limits of a skeleton's joints.
pub(crate) struct Anatomy<'a> {
    skeleton: &'a Skeleton,
    /// Per joint the rotation from the bind pose to the neutral pose.
    neutral: Vec<Turn>,
}

impl<'a> Anatomy<'a> {
    pub fn new(skeleton: &'a Skeleton) -> Self {
        let down = |joint| match joint {
            Foot(_) => Some(Vec3::z()),
            joint => bone_end(joint).map(|_| -Vec3::y()),
        };
        Self { skeleton, neutral: aligned(skeleton, down) }
    }

    /// The rotation from the bind pose to the neutral pose, in whose axes a joint's rotation is measured.
    pub fn neutral(&self, j: JointId) -> Turn {
        self.neutral[j.index()]
    }

    fn neutral_above(&self, j: JointId) -> Turn {
        self.skeleton.parents[j.index()].map_or_else(Turn::identity, |parent| self.neutral[parent.index()])
    }

    /// The rotation of a joint from the neutral pose, relative to the joint above, in anatomical axes.
    pub fn rotation(&self, pose: &Pose, j: JointId) -> Turn {
        self.neutral_above(j) * pose.rotations[j.index()] * self.neutral[j.index()].inverse()
    }

    /// Sets a joint's rotation from the neutral pose.
    pub fn set(&self, pose: &mut Pose, j: JointId, rotation: &Turn) {
        pose.rotations[j.index()] = self.neutral_above(j).inverse() * rotation * self.neutral[j.index()];
    }

    /// The rotation within its limits of one joint, as in a pose; `None` if it is within them.
    pub fn limited_joint(&self, pose: &Pose, j: JointId) -> Option<Turn> {
        let within = clamped(self.skeleton.human_joint(j)?, &self.rotation(pose, j))?;
        Some(self.neutral_above(j).inverse() * within * self.neutral[j.index()])
    }

    /// The pose within the limits, and how many joints were beyond them. A pose within the limits is not changed.
    pub fn limited(&self, pose: &Pose) -> (Pose, usize) {
        let mut limited = pose.clone();
        for side in Side::BOTH {
            let [of_arm, of_leg] = GREATEST_TRANSFER_DEG;
            self.transfer_bend(&mut limited, [UpperArm(side), LowerArm(side)], -1.0, of_arm);
            self.transfer_bend(&mut limited, [UpperLeg(side), LowerLeg(side)], 1.0, of_leg);
            self.transfer_twist(&mut limited, LowerArm(side), Hand(side));
        }
        for chain in SHARED {
            self.share(&mut limited, chain);
        }
        let mut beyond = 0;
        for j in self.skeleton.ids() {
            let Some(joint) = self.skeleton.human_joint(j) else { continue };
            let rotation = self.rotation(&limited, j);
            if let Some(within) = clamped(joint, &rotation) {
                self.set(&mut limited, j, &within);
                beyond += 1;
            }
        }
        (limited, beyond)
    }

    /// Turns the upper part of a limb about its own axis until its hinge bends the way it can; all segments keep their
    /// directions. `flexion` is the sign of the hinge's flexion about x, `greatest_deg` the greatest turn.
    fn transfer_bend(&self, pose: &mut Pose, [upper, lower]: [HumanJoint; 2], flexion: f64, greatest_deg: f64) {
        let (Some(upper), Some(lower)) = (self.skeleton.find(upper), self.skeleton.find(lower)) else { return };
        let bend = self.rotation(pose, lower);
        let (swing, _) = swing_twist(&bend);
        let angle = swing.norm();
        let sideways = (swing.z).atan2(flexion * swing.x);
        let allowed = (HINGE_SIDEWAYS_DEG.to_radians() / angle.max(1e-9)).min(1.0).asin();
        let excess = sideways - sideways.clamp(-allowed, allowed);
        // A joint that bends backwards is straightened, not turned round.
        let is_backward = sideways.abs() > greatest_deg.max(90.0).to_radians();
        if excess == 0.0 || is_backward || excess.abs() > greatest_deg.to_radians() {
            return;
        }
        // A turn by θ about y takes the swing (x, z) to (x cos θ + z sin θ, z cos θ − x sin θ).
        let twist = Turn::from_axis_angle(&Vec3::y_axis(), -flexion * excess);
        let above = self.rotation(pose, upper) * twist;
        self.set(pose, upper, &above);
        self.set(pose, lower, &(twist.inverse() * bend));
    }

    /// Moves the twist of a joint beyond its limit to the joint above; the joint itself keeps its rotation.
    fn transfer_twist(&self, pose: &mut Pose, above: HumanJoint, joint: HumanJoint) {
        let (Some(above), Some(j)) = (self.skeleton.find(above), self.skeleton.find(joint)) else { return };
        let rotation = self.rotation(pose, j);
        let (_, twist) = swing_twist(&rotation);
        let limit = WRIST_TWIST_DEG.to_radians();
        let excess = twist - twist.clamp(-limit, limit);
        if excess == 0.0 {
            return;
        }
        let twist = Turn::from_axis_angle(&Vec3::y_axis(), excess);
        let of_above = self.rotation(pose, above) * twist;
        self.set(pose, above, &of_above);
        self.set(pose, j, &(twist.inverse() * rotation));
    }

    /// Shares the rotation of a chain between its joints where one of them is beyond its limits.
    fn share(&self, pose: &mut Pose, chain: &[(HumanJoint, f64)]) {
        let joints: Vec<(HumanJoint, JointId, f64)> =
            chain.iter().filter_map(|&(joint, share)| Some((joint, self.skeleton.find(joint)?, share))).collect();
        if joints.iter().all(|(joint, j, _)| clamped(*joint, &self.rotation(pose, *j)).is_none()) {
            return;
        }
        let whole = joints.iter().fold(Turn::identity(), |whole, (_, j, _)| whole * self.rotation(pose, *j));
        let sum: f64 = joints.iter().map(|(_, _, share)| share).sum();
        let vector = whole.scaled_axis();
        for (_, j, share) in joints {
            self.set(pose, j, &Turn::from_scaled_axis(vector * (share / sum)));
        }
    }
}

/// The rotation within a joint's limits; `None` if it is within them.
fn clamped(joint: HumanJoint, rotation: &Turn) -> Option<Turn> {
    /// Radians by which a rotation may exceed a limit without being cut off: rounding.
    const ROUNDING: f64 = 1e-9;
    let is_right = joint.side() == Some(Right);
    let left = if is_right { mirrored(rotation) } else { *rotation };
    let within = match (joint, box_of(joint)) {
        (UpperArm(_), _) => clamped_shoulder(&left),
        (Foot(_) | Toes(_) | Spine | Chest | UpperChest | Neck | Head | Shoulder(_), Some(ranges)) => {
            let vector = left.scaled_axis();
            let mut inside = vector;
            for (value, range) in inside.iter_mut().zip(ranges) {
                *value = clamp_deg(*value, range);
            }
            Turn::from_scaled_axis(inside)
        }
        (_, Some([x, y, z])) => {
            let (swing, twist) = swing_twist(&left);
            let inside = Vec3::new(clamp_deg(swing.x, x), 0.0, clamp_deg(swing.z, z));
            Turn::from_scaled_axis(inside) * Turn::from_axis_angle(&Vec3::y_axis(), clamp_deg(twist, y))
        }
        (_, None) => return None,
    };
    let moved = left.angle_to(&within) > ROUNDING;
    moved.then(|| if is_right { mirrored(&within) } else { within })
}

/// The shoulder reaches most directions: not further back than 60°, nor across the body than 50°. Its twist is limited as
/// long as it is defined.
fn clamped_shoulder(rotation: &Turn) -> Turn {
    /// Sines of 60° backwards and 50° across.
    const BACK: f64 = 0.866;
    const ACROSS: f64 = 0.766;
    let (mut swing, twist) = swing_twist(rotation);
    let arm = Turn::from_scaled_axis(swing) * -Vec3::y();
    let inside = Vec3::new(arm.x.max(-ACROSS), arm.y, arm.z.max(-BACK));
    if inside != arm {
        let rest = 1.0 - inside.x * inside.x - inside.z * inside.z;
        let target = Vec3::new(inside.x, rest.max(0.0).sqrt() * if arm.y > 0.0 { 1.0 } else { -1.0 }, inside.z);
        let (from, to) = (Unit::new_normalize(-Vec3::y()), Unit::new_normalize(target));
        swing = Turn::rotation_between_axis(&from, &to).map_or(swing, |turn| turn.scaled_axis());
    }
    let fade = ((swing.norm().to_degrees() - TWIST_FADES_FROM_DEG) / (160.0 - TWIST_FADES_FROM_DEG)).clamp(0.0, 1.0);
    let range = (-90.0 - 90.0 * fade, 100.0 + 80.0 * fade);
    Turn::from_scaled_axis(swing) * Turn::from_axis_angle(&Vec3::y_axis(), clamp_deg(twist, range))
}

fn clamp_deg(angle: f64, (least, greatest): Range) -> f64 {
    angle.clamp(least.to_radians(), greatest.to_radians())
}

/// The rotation of the other side: reflected in the plane x = 0.
fn mirrored(rotation: &Turn) -> Turn {
    Turn::new_unchecked(Quaternion::new(rotation.w, rotation.i, -rotation.j, -rotation.k))
}

/// A rotation as a swing, a rotation vector without y, after a twist about y: `R = swing · twist`. Both are below half a turn.
pub(super) fn swing_twist(rotation: &Turn) -> (Vec3, f64) {
    let q = if rotation.w < 0.0 { -rotation.into_inner() } else { rotation.into_inner() };
    // A half turn about an axis across y has no definite twist.
    let twist = if q.w.hypot(q.j) < 1e-9 { 0.0 } else { 2.0 * q.j.atan2(q.w) };
    let swing = Turn::new_unchecked(q) * Turn::from_axis_angle(&Vec3::y_axis(), -twist);
    let vector = swing.scaled_axis();
    (Vec3::new(vector.x, 0.0, vector.z), wrapped_angle(twist))
}
