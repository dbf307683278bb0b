//! The limbs of a skeleton's joints, and their shares in skin weights.

use super::human_joint::Limb;
use super::{JointId, Skeleton};

impl Limb {
    /// The limb of each joint of a skeleton.
    ///
    /// **Shapes** one entry per joint.
    pub fn of_joints(skeleton: &Skeleton) -> Vec<Self> {
        let is_of = |limb: &Self, joint| skeleton.is_part_of(joint, limb.root());
        skeleton
            .ids()
            .map(|joint| Self::ALL[1..].iter().copied().find(|limb| is_of(limb, joint)).unwrap_or(Self::Trunk))
            .collect()
    }

    /// How much of one row of skin weights belongs to each limb.
    ///
    /// **Shapes** one share per limb, in the order of [`Self::ALL`]; `limb_of_joint` has one entry per joint.
    pub fn shares(row: &[(JointId, f64)], limb_of_joint: &[Self]) -> [f64; 5] {
        let mut shares = [0.0; 5];
        for &(joint, weight) in row {
            shares[limb_of_joint[joint.index()].index()] += weight;
        }
        shares
    }
}
