//! Joints, their hierarchy, and poses.

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

/// The 22 body joints by their VRM 1.0 names, parents before children.
pub const JOINT_NAMES: [&str; 22] = [
    "hips",
    "spine",
    "chest",
    "upperChest",
    "neck",
    "head",
    "leftShoulder",
    "leftUpperArm",
    "leftLowerArm",
    "leftHand",
    "rightShoulder",
    "rightUpperArm",
    "rightLowerArm",
    "rightHand",
    "leftUpperLeg",
    "leftLowerLeg",
    "leftFoot",
    "leftToes",
    "rightUpperLeg",
    "rightLowerLeg",
    "rightFoot",
    "rightToes",
];

/// The parent of each of [`JOINT_NAMES`], by its place there.
pub const JOINT_PARENTS: [Option<JointId>; 22] = {
    const fn below(parent: u16) -> Option<JointId> {
        Some(JointId(parent))
    }
    [
        None,
        below(0),
        below(1),
        below(2),
        below(3),
        below(4),
        below(3),
        below(6),
        below(7),
        below(8),
        below(3),
        below(10),
        below(11),
        below(12),
        below(0),
        below(14),
        below(15),
        below(16),
        below(0),
        below(18),
        below(19),
        below(20),
    ]
};

/// Bounds of a joint's rotation vector, relative to the bind pose, in radians.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointLimits {
    /// Least components.
    pub min: Vec3,
    /// Greatest components.
    pub max: Vec3,
}

/// Joints in the bind pose.
///
/// **Guarantees** every parent comes before its children; joint 0 is the only root.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Skeleton {
    /// VRM names where the joint is one of [`JOINT_NAMES`].
    pub names: Vec<String>,
    /// Parent of each joint; `None` for the root.
    pub parents: Vec<Option<JointId>>,
    /// Joint centres in the bind pose.
    pub joints_in_bind: Vec<Point>,
}

/// Joint rotations and the root's translation.
///
/// Each rotation turns the joint's subtree about the joint, in axes parallel to the bind pose's, after which the
/// parents' rotations apply. The identity with no translation is the bind pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Moves the root joint from where it is in the bind pose.
    pub translation: Vec3,
    /// One a joint.
    pub rotations: Vec<UnitQuaternion<f64>>,
}

impl Pose {
    /// The bind pose.
    pub fn bind(joint_count: usize) -> Self {
        Self { translation: Vec3::zeros(), rotations: vec![UnitQuaternion::identity(); joint_count] }
    }
}

impl Skeleton {
    /// How many joints.
    pub fn len(&self) -> usize {
        self.parents.len()
    }
    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.parents.is_empty()
    }
    /// All joints, parents first.
    pub fn ids(&self) -> impl Iterator<Item = JointId> + use<> {
        (0..self.parents.len() as u16).map(JointId)
    }
    /// The joint of that name.
    pub fn find(&self, name: &str) -> Option<JointId> {
        self.names.iter().position(|n| n == name).map(|i| JointId(i as u16))
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
            many => many.iter().copied().find(|c| {
                let name = self.names[c.index()].as_str();
                matches!(name, "spine" | "chest" | "upperChest" | "neck" | "head")
            }),
        }
    }

    /// `world_from_bind` of each joint: `G_j = G_parent · T(J_j) R_j T(−J_j)`.
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
    pub fn joints_in_world(&self, pose: &Pose) -> Vec<Point> {
        self.world_from_bind(pose).iter().zip(&self.joints_in_bind).map(|(t, p)| t * p).collect()
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
}
