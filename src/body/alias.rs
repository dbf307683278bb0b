//! Other rigs' names for the human joints.

use super::human_joint::{HumanJoint, Side};

impl HumanJoint {
    /// The bone of MakeHuman's default rig whose head is this joint.
    pub fn makehuman_bone(self) -> &'static str {
        use HumanJoint::{
            Chest, Foot, Hand, Head, Hips, LowerArm, LowerLeg, Neck, Shoulder, Spine, Toes, UpperArm, UpperChest,
            UpperLeg,
        };
        use Side::{Left, Right};
        match self {
            Hips => "root",
            Spine => "spine05",
            Chest => "spine03",
            UpperChest => "spine01",
            Neck => "neck01",
            Head => "head",
            Shoulder(Left) => "clavicle.L",
            Shoulder(Right) => "clavicle.R",
            UpperArm(Left) => "upperarm01.L",
            UpperArm(Right) => "upperarm01.R",
            LowerArm(Left) => "lowerarm01.L",
            LowerArm(Right) => "lowerarm01.R",
            Hand(Left) => "wrist.L",
            Hand(Right) => "wrist.R",
            UpperLeg(Left) => "upperleg01.L",
            UpperLeg(Right) => "upperleg01.R",
            LowerLeg(Left) => "lowerleg01.L",
            LowerLeg(Right) => "lowerleg01.R",
            Foot(Left) => "foot.L",
            Foot(Right) => "foot.R",
            Toes(Left) => "toe1-1.L",
            Toes(Right) => "toe1-1.R",
        }
    }

    /// The joint with this VRM name, or with this name in MakeHuman's default rig.
    pub fn from_any_name(name: &str) -> Option<Self> {
        Self::from_name(name).or_else(|| Self::BODY.into_iter().find(|joint| joint.makehuman_bone() == name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_rigs_name_the_same_joint() {
        let hand = HumanJoint::Hand(Side::Left);
        assert_eq!(HumanJoint::from_any_name("leftHand"), Some(hand));
        assert_eq!(HumanJoint::from_any_name("wrist.L"), Some(hand));
        assert_eq!(HumanJoint::from_any_name("toe1-1.R"), Some(HumanJoint::Toes(Side::Right)));
        assert_eq!(HumanJoint::from_any_name("tail"), None);
    }
}
