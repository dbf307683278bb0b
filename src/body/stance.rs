//! Named poses for inspecting a model.

use super::human_joint::HumanJoint::{
    self, Chest, Foot, Head, Hips, LowerArm, LowerLeg, Neck, Shoulder, Spine, UpperArm, UpperLeg,
};
use super::human_joint::Side::{self, Left, Right};
use super::{JointId, Pose, Skeleton};
use crate::geometry::Vec3;
use nalgebra::{Unit, UnitQuaternion};

/// A pose that every humanoid skeleton can take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stance {
    /// The bind pose.
    Bind,
    /// Legs together and arms hanging, as for measuring.
    Upright,
    /// Arms level, to the sides.
    TPose,
    /// Both arms overhead.
    ArmsUp,
    /// Both arms level, to the front.
    ArmsForward,
    /// A deep squat, arms out for balance.
    Squat,
    /// The head turned to the left.
    HeadTurned,
    /// A long step, the left leg ahead.
    Stride,
    /// The left thigh level, to the front, its lower leg hanging.
    ThighRaised,
}

impl Stance {
    /// All stances.
    pub const ALL: [Self; 9] = [
        Self::Bind,
        Self::Upright,
        Self::TPose,
        Self::ArmsUp,
        Self::ArmsForward,
        Self::Squat,
        Self::HeadTurned,
        Self::Stride,
        Self::ThighRaised,
    ];

    /// The stances that strain cloth most: it must not tear in any of them, nor in their mirror images.
    pub const STRAINING: [Self; 4] = [Self::ArmsUp, Self::Squat, Self::ThighRaised, Self::Stride];

    /// The stance's name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bind => "bind",
            Self::Upright => "upright",
            Self::TPose => "t-pose",
            Self::ArmsUp => "arms-up",
            Self::ArmsForward => "arms-forward",
            Self::Squat => "squat",
            Self::HeadTurned => "head-turned",
            Self::Stride => "stride",
            Self::ThighRaised => "thigh-raised",
        }
    }

    /// The pose. It does not depend on the skeleton's bind pose: each bone is aimed by the smallest rotation.
    ///
    /// A human joint that the skeleton does not have is not turned.
    pub fn pose(self, skeleton: &Skeleton) -> Pose {
        let mut figure = Aimed { skeleton, pose: Pose::bind(skeleton.len()) };
        match self {
            Self::Bind => {}
            Self::Upright => {
                figure.both_arms([0.14, -1.0, 0.04], [0.10, -1.0, 0.10], -4.0);
                figure.both(UpperLeg, [0.0, -1.0, 0.0]);
                figure.both(LowerLeg, [0.0, -1.0, 0.0]);
                figure.level_feet();
            }
            Self::TPose => figure.both_arms([1.0, 0.0, 0.0], [1.0, 0.0, 0.0], 8.0),
            // The collar bone contributes a third of an arm's rise above horizontal (Inman's scapulohumeral rhythm).
            Self::ArmsUp => figure.both_arms([0.22, 1.0, 0.0], [0.05, 1.0, 0.05], 32.0),
            Self::ArmsForward => {
                for side in Side::BOTH {
                    figure.turn(Shoulder(side), [0.0, -14.0 * side.sign(), 0.0]);
                }
                figure.both_arms([0.12, 0.0, 1.0], [0.0, 0.0, 1.0], 6.0);
            }
            Self::Squat => {
                figure.turn(Hips, [28.0, 0.0, 0.0]);
                figure.turn(Spine, [12.0, 0.0, 0.0]);
                figure.turn(Chest, [6.0, 0.0, 0.0]);
                figure.turn(Neck, [-18.0, 0.0, 0.0]);
                figure.both_arms([0.35, 0.0, 1.0], [0.15, 0.05, 1.0], 6.0);
                figure.both(UpperLeg, [0.32, 0.05, 1.0]);
                figure.both(LowerLeg, [0.04, -1.0, -0.42]);
                figure.level_feet();
            }
            Self::HeadTurned => {
                figure.turn(Neck, [0.0, 32.0, 0.0]);
                figure.turn(Head, [0.0, 36.0, 0.0]);
            }
            Self::Stride => {
                figure.turn(Chest, [3.0, 8.0, 0.0]);
                for side in Side::BOTH {
                    let sign = side.sign();
                    let at = |x: f64, y: f64, z: f64| Vec3::new(x * sign, y, z * sign);
                    figure.aim(UpperArm(side), at(0.22, -1.0, -0.35));
                    figure.aim(LowerArm(side), at(0.10, -1.0, -0.05 + 0.3 * sign));
                    figure.aim(UpperLeg(side), at(0.08, -1.0, 0.50));
                }
                figure.aim(LowerLeg(Left), Vec3::new(0.02, -1.0, 0.28));
                figure.aim(LowerLeg(Right), Vec3::new(-0.02, -1.0, -0.95));
            }
            Self::ThighRaised => {
                figure.aim(UpperLeg(Left), Vec3::z());
                figure.aim(LowerLeg(Left), -Vec3::y());
                figure.level_feet();
            }
        }
        figure.pose
    }

    /// The pose with left and right exchanged: each joint has the rotation of its counterpart, reflected. On a skeleton that
    /// is not symmetric, bones miss their directions by as much as their sides differ.
    pub fn mirrored_pose(self, skeleton: &Skeleton) -> Pose {
        let pose = self.pose(skeleton);
        let mut mirrored = Pose::bind(skeleton.len());
        for joint in HumanJoint::BODY {
            if let (Some(to), Some(from)) = (skeleton.find(joint), skeleton.find(joint.mirrored())) {
                let vector = pose.rotations[from.index()].scaled_axis();
                let reflected = Vec3::new(vector.x, -vector.y, -vector.z);
                mirrored.rotations[to.index()] = UnitQuaternion::from_scaled_axis(reflected);
            }
        }
        mirrored
    }
}

struct Aimed<'a> {
    skeleton: &'a Skeleton,
    pose: Pose,
}

impl Aimed<'_> {
    /// Turns a joint by a rotation vector in degrees, in the axes of the bind pose.
    fn turn(&mut self, joint: HumanJoint, degrees: [f64; 3]) {
        if let Some(j) = self.skeleton.find(joint) {
            let vector = Vec3::from(degrees.map(f64::to_radians));
            self.pose.rotations[j.index()] = UnitQuaternion::from_scaled_axis(vector);
        }
    }

    /// Turns a joint so that its bone points along `direction` in the world.
    fn aim(&mut self, joint: HumanJoint, direction: Vec3) {
        let Some(j) = self.skeleton.find(joint) else { return };
        let Some(end) = self.skeleton.bone_end(j) else { return };
        let bone = self.skeleton.joints_in_bind[end.index()] - self.skeleton.joints_in_bind[j.index()];
        let wanted = self.above(j).inverse() * direction;
        self.pose.rotations[j.index()] = smallest_rotation(&bone, &wanted);
    }

    /// The rotation of the frame in which a joint turns.
    fn above(&self, joint: JointId) -> UnitQuaternion<f64> {
        let mut rotation = UnitQuaternion::identity();
        let mut at = self.skeleton.parents[joint.index()];
        while let Some(j) = at {
            rotation = self.pose.rotations[j.index()] * rotation;
            at = self.skeleton.parents[j.index()];
        }
        rotation
    }

    fn both(&mut self, bone: fn(Side) -> HumanJoint, [x, y, z]: [f64; 3]) {
        for side in Side::BOTH {
            self.aim(bone(side), Vec3::new(x * side.sign(), y, z));
        }
    }

    /// Aims both arms, with the collar bones raised by `raised_deg`.
    fn both_arms(&mut self, upper: [f64; 3], lower: [f64; 3], raised_deg: f64) {
        for side in Side::BOTH {
            if let Some(j) = self.skeleton.find(Shoulder(side)) {
                let raise = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), (raised_deg * side.sign()).to_radians());
                self.pose.rotations[j.index()] = raise * self.pose.rotations[j.index()];
            }
        }
        self.both(UpperArm, upper);
        self.both(LowerArm, lower);
    }

    /// Turns the feet back to their direction in the bind pose.
    fn level_feet(&mut self) {
        for side in Side::BOTH {
            if let Some(foot) = self.skeleton.find(Foot(side)) {
                self.pose.rotations[foot.index()] = self.above(foot).inverse();
            }
        }
    }
}

/// The smallest rotation that turns one direction to another; for opposed ones the half turn about an axis perpendicular
/// to both.
fn smallest_rotation(from: &Vec3, to: &Vec3) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(from, to).unwrap_or_else(|| {
        // The coordinate axis that is farthest from parallel gives the longest cross product.
        let axis = Vec3::ith(from.iamin(), 1.0).cross(from);
        UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis), std::f64::consts::PI)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::body::embedded_model;

    #[test]
    fn a_bone_is_turned_around_to_the_opposite_direction() {
        for bone in [Vec3::x(), Vec3::y(), -Vec3::z(), Vec3::new(0.1, -0.3, 0.2)] {
            let turned = smallest_rotation(&bone, &(-2.0 * bone)) * bone;
            assert!((turned + bone).norm() < 1e-12, "{bone:?} became {turned:?}");
            assert!((smallest_rotation(&bone, &bone) * bone - bone).norm() < 1e-12);
        }
    }

    #[test]
    fn bones_point_where_the_stance_says() {
        let skeleton = embedded_model().unwrap().skeleton;
        let bone = |stance: Stance, from: HumanJoint, to: HumanJoint| {
            let joints = skeleton.joints_in_world(&stance.pose(&skeleton));
            let at = |joint| joints[skeleton.find(joint).unwrap().index()];
            (at(to) - at(from)).normalize()
        };
        for side in Side::BOTH {
            let (upper, lower) = (UpperArm(side), LowerArm(side));
            assert!((bone(Stance::TPose, upper, lower) - Vec3::x() * side.sign()).norm() < 1e-9);
            assert!(bone(Stance::ArmsUp, upper, lower).y > 0.95);
            let leg = bone(Stance::Squat, UpperLeg(side), LowerLeg(side));
            assert!(leg.z > 0.9, "{leg}");
        }
        let left_ahead = bone(Stance::Stride, UpperLeg(Left), LowerLeg(Left)).z;
        assert!(left_ahead > 0.3 && bone(Stance::Stride, UpperLeg(Right), LowerLeg(Right)).z < -0.3);
        let thigh = bone(Stance::ThighRaised, UpperLeg(Left), LowerLeg(Left));
        assert!(thigh.z > 1.0 - 1e-9, "{thigh}");
        assert!(bone(Stance::ThighRaised, LowerLeg(Left), Foot(Left)).y < -1.0 + 1e-9);
        assert!(bone(Stance::ThighRaised, UpperLeg(Right), LowerLeg(Right)).y < -0.9, "the other leg stands");
        let same = Stance::Bind.pose(&skeleton);
        assert_eq!(same, Pose::bind(skeleton.len()));
    }

    #[test]
    fn a_mirrored_pose_raises_the_other_leg() {
        let skeleton = embedded_model().unwrap().skeleton;
        let pose = Stance::ThighRaised.mirrored_pose(&skeleton);
        let joints = skeleton.joints_in_world(&pose);
        let at = |joint| joints[skeleton.find(joint).unwrap().index()];
        let [left, right] = Side::BOTH.map(|side| (at(LowerLeg(side)) - at(UpperLeg(side))).normalize());
        assert!(right.z > 0.95 && left.y < -0.9, "{left} {right}");
        let stride = Stance::Stride.mirrored_pose(&skeleton);
        let ahead = skeleton.find(UpperLeg(Right)).unwrap();
        assert!(stride.rotations[ahead.index()].scaled_axis().x < -0.3, "the right thigh swings forward");
    }
}
