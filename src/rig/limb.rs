//! Which limb a joint belongs to: cloth of one limb takes nothing from another.

use crate::body::{JointId, Skeleton};
use serde::{Deserialize, Serialize};

/// A limb, or the trunk with neck, head and shoulders.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Limb {
    /// Hips, spine, shoulders, neck, head; and all joints of a skeleton without VRM names.
    Trunk,
    /// Left upper arm and below.
    LeftArm,
    /// Right upper arm and below.
    RightArm,
    /// Left upper leg and below.
    LeftLeg,
    /// Right upper leg and below.
    RightLeg,
}

impl Limb {
    /// All of them, the trunk first.
    pub const ALL: [Self; 5] = [Self::Trunk, Self::LeftArm, Self::RightArm, Self::LeftLeg, Self::RightLeg];

    /// The limb of each joint.
    pub fn of_joints(skeleton: &Skeleton) -> Vec<Self> {
        let roots = [
            ("leftUpperArm", Self::LeftArm),
            ("rightUpperArm", Self::RightArm),
            ("leftUpperLeg", Self::LeftLeg),
            ("rightUpperLeg", Self::RightLeg),
        ]
        .map(|(name, limb)| (skeleton.find(name), limb));
        skeleton
            .ids()
            .map(|joint| {
                let below = |root: &Option<JointId>| root.is_some_and(|r| skeleton.is_below(joint, r));
                roots.iter().find(|(root, _)| below(root)).map_or(Self::Trunk, |&(_, limb)| limb)
            })
            .collect()
    }

    /// How much of a row of skin weights each limb has, in the order of [`Self::ALL`].
    pub fn shares(row: &[(JointId, f64)], limb_of_joint: &[Self]) -> [f64; 5] {
        let mut shares = [0.0; 5];
        for &(joint, weight) in row {
            shares[limb_of_joint[joint.index()] as usize] += weight;
        }
        shares
    }
}
