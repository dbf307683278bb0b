//! Joints, their hierarchy, and poses.

use super::human_joint::{HumanJoint, Side, words_of};
use crate::geometry::{Point, Vec3};
use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};

/// A joint of one particular skeleton; 0 is the root.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct JointId(pub u16);

impl JointId {
    /// The position of this joint in a plain array.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Bounds of a joint's rotation vector, relative to the bind pose, in radians.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointLimits {
    /// Smallest components.
    pub min: Vec3,
    /// Greatest components.
    pub max: Vec3,
}

/// Joints in the bind pose.
///
/// **Shapes** `names`, `parents`, `joints_in_bind`: one entry per joint.
///
/// **Guarantees** every parent comes before its children; joint 0 is the only root.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Skeleton {
    /// The VRM name of each [`HumanJoint`]; further joints have any other name.
    pub names: Vec<String>,
    /// Parent of each joint; `None` for the root.
    pub parents: Vec<Option<JointId>>,
    /// Joint centres in the bind pose.
    pub joints_in_bind: Vec<Point>,
}

/// Joint rotations and the root's translation.
///
/// **Shapes** `rotations`: one per joint.
///
/// Each rotation turns the joint's subtree about the joint, in axes parallel to the bind pose's, after which the
/// parents' rotations apply. The identity with no translation is the bind pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Moves the root joint from its position in the bind pose, in metres.
    pub translation: Vec3,
    /// Rotation of each joint.
    pub rotations: Vec<UnitQuaternion<f64>>,
}

impl Pose {
    /// The bind pose.
    pub fn bind(joint_count: usize) -> Self {
        Self { translation: Vec3::zeros(), rotations: vec![UnitQuaternion::identity(); joint_count] }
    }
}

impl Pose {
    /// A pose on the way to another: 0 is this one, 1 the other.
    ///
    /// **Requires** as many joints in both.
    pub fn toward(&self, other: &Self, share: f64) -> Self {
        let rotations = self.rotations.iter().zip(&other.rotations);
        Self {
            translation: self.translation.lerp(&other.translation, share),
            rotations: rotations.map(|(a, b)| a.try_slerp(b, share, 1e-9).unwrap_or(*b)).collect(),
        }
    }
}

impl Skeleton {
    /// The number of joints.
    pub fn len(&self) -> usize {
        self.parents.len()
    }
    /// Whether there are no joints.
    pub fn is_empty(&self) -> bool {
        self.parents.is_empty()
    }
    /// All joints, parents first.
    pub fn ids(&self) -> impl Iterator<Item = JointId> + use<> {
        (0..self.parents.len() as u16).map(JointId)
    }
    /// The names of [`HumanJoint::BODY`], in that order.
    pub fn body_names() -> Vec<String> {
        HumanJoint::BODY.iter().map(|joint| joint.name().to_string()).collect()
    }
    /// The parent of each of [`HumanJoint::BODY`], in that order.
    ///
    /// **Shapes** J of [`HumanJoint::BODY`].
    pub fn body_parents() -> Vec<Option<JointId>> {
        let id = |joint: HumanJoint| HumanJoint::BODY.iter().position(|&j| j == joint).map(|k| JointId(k as u16));
        HumanJoint::BODY.iter().map(|joint| joint.parent().and_then(id)).collect()
    }
    /// Where a human joint is in this skeleton; `None` if it has no such joint.
    pub fn find(&self, joint: HumanJoint) -> Option<JointId> {
        self.find_name(joint.name())
    }
    /// The joint with this name, human or not.
    pub fn find_name(&self, name: &str) -> Option<JointId> {
        self.names.iter().position(|n| n == name).map(|i| JointId(i as u16))
    }
    /// The joint of the other side, human or not, as that of a finger; `None` for a joint in the middle.
    pub fn mirrored(&self, joint: JointId) -> Option<JointId> {
        let name = &self.names[joint.index()];
        let other = match (name.strip_prefix("left"), name.strip_prefix("right")) {
            (Some(rest), _) => format!("right{rest}"),
            (_, Some(rest)) => format!("left{rest}"),
            _ => return None,
        };
        self.find_name(&other)
    }
    /// Which human joint this is; `None` for a further joint, such as that of a finger or an eye.
    pub fn human_joint(&self, joint: JointId) -> Option<HumanJoint> {
        HumanJoint::from_name(&self.names[joint.index()])
    }
    /// The body part that begins at a joint, in words: `right arm`, `left lower leg`.
    pub fn part_name(&self, joint: JointId) -> String {
        words_of(&self.names[joint.index()])
    }
    /// Whether `joint` is the human joint `root` or hangs below it; false if the skeleton has no such joint.
    pub fn is_part_of(&self, joint: JointId, root: HumanJoint) -> bool {
        self.find(root).is_some_and(|ancestor| self.is_below(joint, ancestor))
    }
    /// Whether the joint hangs below a hand.
    pub fn is_finger(&self, joint: JointId) -> bool {
        self.human_joint(joint).is_none()
            && Side::BOTH.iter().any(|&side| self.is_part_of(joint, HumanJoint::Hand(side)))
    }
    /// For each joint itself; for a finger joint the hand.
    ///
    /// **Shapes** one entry per joint.
    pub fn body_joints(&self) -> Vec<JointId> {
        let hands = Side::BOTH.map(|side| self.find(HumanJoint::Hand(side)));
        let hand_of = |joint: JointId| hands.iter().flatten().copied().find(|&hand| self.is_below(joint, hand));
        self.ids().map(|joint| hand_of(joint).unwrap_or(joint)).collect()
    }
    /// Whether `joint` is `ancestor` or hangs below it.
    pub fn is_below(&self, joint: JointId, ancestor: JointId) -> bool {
        let mut at = Some(joint);
        while let Some(j) = at {
            if j == ancestor {
                return true;
            }
            at = self.parents[j.index()];
        }
        false
    }
    /// The joint that ends this one's bone: the child of the chain (head for neck, hand for lower arm), if any.
    pub fn bone_end(&self, joint: JointId) -> Option<JointId> {
        let children: Vec<JointId> = self.ids().filter(|&c| self.parents[c.index()] == Some(joint)).collect();
        match children.as_slice() {
            [] => None,
            [only] => Some(*only),
            many => many.iter().copied().find(|&c| {
                use HumanJoint::{Chest, Head, Neck, Spine, UpperChest};
                matches!(self.human_joint(c), Some(Spine | Chest | UpperChest | Neck | Head))
            }),
        }
    }

    /// `world_from_bind`, one transform per joint: `G_j = G_parent · T(J_j) R_j T(−J_j)`.
    pub fn world_from_bind(&self, pose: &Pose) -> Vec<Isometry3<f64>> {
        let mut transforms: Vec<Isometry3<f64>> = Vec::with_capacity(self.len());
        for j in self.ids() {
            let about_joint = rotation_about(&self.joints_in_bind[j.index()], &pose.rotations[j.index()]);
            let transform = match self.parents[j.index()] {
                Some(parent) => transforms[parent.index()] * about_joint,
                None => Translation3::from(pose.translation) * about_joint,
            };
            transforms.push(transform);
        }
        transforms
    }

    /// Joint centres in the posed frame.
    ///
    /// **Shapes** `J × 3`, in metres.
    pub fn joints_in_world(&self, pose: &Pose) -> Vec<Point> {
        self.world_from_bind(pose).iter().zip(&self.joints_in_bind).map(|(t, p)| t * p).collect()
    }

    /// A pose as it is relative to `rest`, the bind pose of a skeleton whose root is at `root` there. All joints are where they
    /// were.
    pub fn pose_from_rest(&self, pose: &Pose, rest: &Pose, root: &Point) -> Pose {
        let of_rest: Vec<UnitQuaternion<f64>> = self.world_from_bind(rest).iter().map(|t| t.rotation).collect();
        let above = |j: JointId| self.parents[j.index()].map_or_else(UnitQuaternion::identity, |p| of_rest[p.index()]);
        let rotation = |j: JointId| above(j) * pose.rotations[j.index()] * of_rest[j.index()].inverse();
        let shift = self.joints_in_bind.first().map_or_else(Vec3::zeros, |own| own - root);
        Pose { translation: pose.translation + shift, rotations: self.ids().map(rotation).collect() }
    }
}

fn rotation_about(center: &Point, rotation: &UnitQuaternion<f64>) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(center.coords - rotation * center.coords), *rotation)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain() -> Skeleton {
        Skeleton {
            names: ["a", "b", "c"].map(String::from).to_vec(),
            parents: vec![None, Some(JointId(0)), Some(JointId(1))],
            joints_in_bind: vec![Point::origin(), Point::new(0.0, 1.0, 0.0), Point::new(0.0, 2.0, 0.0)],
        }
    }

    #[test]
    fn bending_the_middle_moves_only_what_is_below() {
        let skeleton = chain();
        let mut pose = Pose::bind(3);
        pose.rotations[1] = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), std::f64::consts::FRAC_PI_2);
        let joints = skeleton.joints_in_world(&pose);
        assert!((joints[1] - Point::new(0.0, 1.0, 0.0)).norm() < 1e-12);
        assert!((joints[2] - Point::new(-1.0, 1.0, 0.0)).norm() < 1e-12);
        assert!(skeleton.is_below(JointId(2), JointId(0)));
        assert!(!skeleton.is_below(JointId(0), JointId(2)));
    }
    #[test]
    fn a_pose_relative_to_another_bind_pose_leaves_all_joints_where_they_are() {
        let skeleton = chain();
        let turned = |k: f64| {
            let mut pose = Pose::bind(3);
            pose.translation = Vec3::new(0.1 * k, 0.3, -0.2);
            for (j, rotation) in pose.rotations.iter_mut().enumerate() {
                *rotation = UnitQuaternion::from_euler_angles(0.3 * k, 0.5 - j as f64, 0.7 * k * j as f64);
            }
            pose
        };
        let (rest, pose) = (turned(1.0), turned(-0.8));
        let mut other = skeleton.clone();
        let on_floor = |p: Point| p - Vec3::y() * 0.4;
        other.joints_in_bind = skeleton.joints_in_world(&rest).into_iter().map(on_floor).collect();
        let relative = skeleton.pose_from_rest(&pose, &rest, &other.joints_in_bind[0]);
        let pairs = skeleton.joints_in_world(&pose).into_iter().zip(other.joints_in_world(&relative));
        assert!(pairs.into_iter().all(|(p, q)| (p - q).norm() < 1e-12));
        let of_rest = skeleton.world_from_bind(&rest)[2].rotation;
        let whole = other.world_from_bind(&relative)[2].rotation * of_rest;
        assert!(whole.angle_to(&skeleton.world_from_bind(&pose)[2].rotation) < 1e-12);
    }
    #[test]
    fn a_joint_and_that_of_the_other_side_mirror_each_other() {
        let names = ["hips", "leftHand", "rightHand", "leftThumbDistal", "rightThumbDistal", "leftEye"];
        let skeleton = Skeleton {
            names: names.map(String::from).to_vec(),
            parents: std::iter::once(None).chain([0, 0, 1, 2, 0].map(|p| Some(JointId(p)))).collect(),
            joints_in_bind: vec![Point::origin(); names.len()],
        };
        let mirrored: Vec<_> = skeleton.ids().map(|j| skeleton.mirrored(j).map(JointId::index)).collect();
        assert_eq!(mirrored, [None, Some(2), Some(1), Some(4), Some(3), None]);
    }
}
