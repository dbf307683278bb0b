//! A leg: moved so that the ankle is at a given place.

use crate::body::HumanJoint::{Foot, LowerLeg, Toes, UpperLeg};
use crate::body::{JointId, Pose, Side, Skeleton};
use crate::geometry::{Point, Vec3};
use nalgebra::{Isometry3, Unit, UnitQuaternion};

type Turn = UnitQuaternion<f64>;

/// The joints of a leg.
#[derive(Clone, Debug)]
pub(super) struct Leg {
    pub upper: JointId,
    pub lower: JointId,
    pub foot: JointId,
    pub toes: Option<JointId>,
    /// Bones in the bind pose.
    thigh: Vec3,
    shank: Vec3,
    /// The axis of the knee's flexion in the bind pose.
    hinge: Vec3,
}

impl Leg {
    /// `None` if the skeleton does not have the leg, or has it in another order.
    pub fn of(skeleton: &Skeleton, side: Side) -> Option<Self> {
        let [upper, lower, foot] = [UpperLeg(side), LowerLeg(side), Foot(side)].map(|joint| skeleton.find(joint));
        let (upper, lower, foot) = (upper?, lower?, foot?);
        let is_child = |child: JointId, parent: JointId| skeleton.parents[child.index()] == Some(parent);
        let at = |j: JointId| skeleton.joints_in_bind[j.index()];
        let (thigh, shank) = (at(lower) - at(upper), at(foot) - at(lower));
        let straight = super::aligned::smallest_rotation(&-Vec3::y(), &thigh);
        let toes = skeleton.find(Toes(side)).filter(|&toes| is_child(toes, foot));
        let is_leg = is_child(lower, upper) && is_child(foot, lower) && thigh.norm().min(shank.norm()) > 1e-6;
        is_leg.then(|| Self { upper, lower, foot, toes, thigh, shank, hinge: straight * Vec3::x() })
    }

    pub fn length(&self) -> f64 {
        self.thigh.norm() + self.shank.norm()
    }

    /// Turns thigh and lower leg so that the ankle is at `ankle`, or as near as the leg reaches, the knee bends as it did, and
    /// foot and toes have the given rotations in the world.
    pub fn reach(&self, skeleton: &Skeleton, pose: &mut Pose, ankle: &Point, foot: &Turn, toes: Option<&Turn>) {
        let transforms = skeleton.world_from_bind(pose);
        let above =
            skeleton.parents[self.upper.index()].map_or_else(Turn::identity, |p| transforms[p.index()].rotation);
        let (thigh_turn, shank_turn) = (rotation(&transforms, self.upper), rotation(&transforms, self.lower));
        let hip = transforms[self.upper.index()] * skeleton.joints_in_bind[self.upper.index()];
        let (thigh, shank) = (thigh_turn * self.thigh, shank_turn * self.shank);
        let wanted = ankle - hip;
        let (a, b) = (self.thigh.norm(), self.shank.norm());
        let distance = wanted.norm().clamp((a - b).abs() + 1e-6, a + b - 1e-9);
        let flexed = ((distance * distance - a * a - b * b) / (2.0 * a * b)).clamp(-1.0, 1.0).acos();

        // The axis about which the knee is bent now; that of the hinge where it is straight.
        let hinge = thigh_turn * self.hinge;
        let hinge = (hinge - thigh * (hinge.dot(&thigh) / thigh.norm_squared())).normalize();
        let across = thigh.cross(&shank);
        let angle = across.norm().atan2(thigh.dot(&shank));
        let (axis, bent) = match Unit::try_new(across, 1e-2 * a * b) {
            Some(axis) if axis.dot(&hinge) >= 0.0 => (axis, angle),
            Some(axis) => (-axis, -angle),
            None => (Unit::new_unchecked(hinge), if across.dot(&hinge) < 0.0 { -angle } else { angle }),
        };
        let shank_turn = Turn::from_axis_angle(&axis, flexed - bent) * shank_turn;
        let now = thigh + shank_turn * self.shank;
        let swing = super::aligned::smallest_rotation(&now, &wanted);
        let (thigh_turn, shank_turn) = (swing * thigh_turn, swing * shank_turn);
        pose.rotations[self.upper.index()] = above.inverse() * thigh_turn;
        pose.rotations[self.lower.index()] = thigh_turn.inverse() * shank_turn;
        pose.rotations[self.foot.index()] = shank_turn.inverse() * foot;
        if let (Some(j), Some(toes)) = (self.toes, toes) {
            pose.rotations[j.index()] = foot.inverse() * toes;
        }
    }

    /// How much lower the hips must be for the leg to reach `ankle`; negative if they may be higher.
    pub fn drop_to_reach(&self, hip: &Point, ankle: &Point) -> f64 {
        let level = (ankle - hip).xz().norm();
        let reach = self.length() * REACH;
        let below = (reach * reach - level * level).max(0.0).sqrt();
        (hip.y - ankle.y) - below
    }
}

/// The share of its length that a leg may take: at 1 the knee is straight, and its last degrees take no length.
const REACH: f64 = 0.9995;

fn rotation(transforms: &[Isometry3<f64>], j: JointId) -> Turn {
    transforms[j.index()].rotation
}
