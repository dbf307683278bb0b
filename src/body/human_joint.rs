/// A side of the body, from the person's own view: left is +x in the bind pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// The person's left, +x.
    Left,
    /// The person's right, −x.
    Right,
}

impl Side {
    /// Both sides, left first.
    pub const BOTH: [Self; 2] = [Self::Left, Self::Right];

    /// The other side.
    pub fn mirrored(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    /// The sign of x on this side: 1 left, −1 right.
    pub fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }

    /// `left` or `right`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }
}

/// One of the 22 body joints of VRM 1.0. A skeleton may have further joints, which are not human joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum HumanJoint {
    /// The root.
    Hips,
    /// The lowest joint of the spine.
    Spine,
    /// The middle joint of the spine.
    Chest,
    /// The uppermost joint of the spine, the parent of neck and shoulders.
    UpperChest,
    /// The lower end of the neck.
    Neck,
    /// The upper end of the neck.
    Head,
    /// The inner end of the collar bone.
    Shoulder(Side),
    /// The shoulder joint proper.
    UpperArm(Side),
    /// The elbow.
    LowerArm(Side),
    /// The wrist.
    Hand(Side),
    /// The hip joint.
    UpperLeg(Side),
    /// The knee.
    LowerLeg(Side),
    /// The ankle.
    Foot(Side),
    /// The base of the toes.
    Toes(Side),
}

use HumanJoint::{
    Chest, Foot, Hand, Head, Hips, LowerArm, LowerLeg, Neck, Shoulder, Spine, Toes, UpperArm, UpperChest, UpperLeg,
};
use Side::{Left, Right};

impl HumanJoint {
    /// All 22, parents before children: the order of the embedded body's skeleton.
    pub const BODY: [Self; 22] = [
        Hips,
        Spine,
        Chest,
        UpperChest,
        Neck,
        Head,
        Shoulder(Left),
        UpperArm(Left),
        LowerArm(Left),
        Hand(Left),
        Shoulder(Right),
        UpperArm(Right),
        LowerArm(Right),
        Hand(Right),
        UpperLeg(Left),
        LowerLeg(Left),
        Foot(Left),
        Toes(Left),
        UpperLeg(Right),
        LowerLeg(Right),
        Foot(Right),
        Toes(Right),
    ];

    /// The VRM name, such as `leftUpperArm`.
    pub const fn name(self) -> &'static str {
        match self {
            Hips => "hips",
            Spine => "spine",
            Chest => "chest",
            UpperChest => "upperChest",
            Neck => "neck",
            Head => "head",
            Shoulder(Left) => "leftShoulder",
            Shoulder(Right) => "rightShoulder",
            UpperArm(Left) => "leftUpperArm",
            UpperArm(Right) => "rightUpperArm",
            LowerArm(Left) => "leftLowerArm",
            LowerArm(Right) => "rightLowerArm",
            Hand(Left) => "leftHand",
            Hand(Right) => "rightHand",
            UpperLeg(Left) => "leftUpperLeg",
            UpperLeg(Right) => "rightUpperLeg",
            LowerLeg(Left) => "leftLowerLeg",
            LowerLeg(Right) => "rightLowerLeg",
            Foot(Left) => "leftFoot",
            Foot(Right) => "rightFoot",
            Toes(Left) => "leftToes",
            Toes(Right) => "rightToes",
        }
    }

    /// The joint with this VRM name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::BODY.into_iter().find(|joint| joint.name() == name)
    }

    /// The joint above this one; `None` for the hips.
    pub fn parent(self) -> Option<Self> {
        Some(match self {
            Hips => return None,
            Spine | UpperLeg(_) => Hips,
            Chest => Spine,
            UpperChest => Chest,
            Neck | Shoulder(_) => UpperChest,
            Head => Neck,
            UpperArm(side) => Shoulder(side),
            LowerArm(side) => UpperArm(side),
            Hand(side) => LowerArm(side),
            LowerLeg(side) => UpperLeg(side),
            Foot(side) => LowerLeg(side),
            Toes(side) => Foot(side),
        })
    }

    /// The side of a paired joint; `None` on the midline.
    pub fn side(self) -> Option<Side> {
        match self {
            Hips | Spine | Chest | UpperChest | Neck | Head => None,
            Shoulder(side) | UpperArm(side) | LowerArm(side) | Hand(side) => Some(side),
            UpperLeg(side) | LowerLeg(side) | Foot(side) | Toes(side) => Some(side),
        }
    }

    /// The joint's counterpart on the other side; a joint on the midline is its own.
    pub fn mirrored(self) -> Self {
        match self {
            Hips | Spine | Chest | UpperChest | Neck | Head => self,
            Shoulder(side) => Shoulder(side.mirrored()),
            UpperArm(side) => UpperArm(side.mirrored()),
            LowerArm(side) => LowerArm(side.mirrored()),
            Hand(side) => Hand(side.mirrored()),
            UpperLeg(side) => UpperLeg(side.mirrored()),
            LowerLeg(side) => LowerLeg(side.mirrored()),
            Foot(side) => Foot(side.mirrored()),
            Toes(side) => Toes(side.mirrored()),
        }
    }

    /// The limb that the joint moves.
    pub fn limb(self) -> Limb {
        match self {
            Hips | Spine | Chest | UpperChest | Neck | Head | Shoulder(_) => Limb::Trunk,
            UpperArm(side) | LowerArm(side) | Hand(side) => Limb::Arm(side),
            UpperLeg(side) | LowerLeg(side) | Foot(side) | Toes(side) => Limb::Leg(side),
        }
    }

    /// The body part that begins at this joint, in words: `right arm`, `left lower leg`, `head`.
    pub fn part_name(self) -> String {
        words_of(self.name())
    }
}

/// `rightUpperArm` → "right arm", `leftLowerLeg` → "left lower leg"; works on the names of further joints too.
pub(super) fn words_of(joint_name: &str) -> String {
    let mut words = String::new();
    for c in joint_name.chars() {
        if c.is_uppercase() {
            words.push(' ');
        }
        words.extend(c.to_lowercase());
    }
    words.replace("upper ", "")
}

/// An arm, a leg, or the trunk with neck, head and shoulder girdle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Limb {
    /// Hips, spine, collar bones, neck, head; also every joint that has no human joint of an arm or leg above it.
    Trunk,
    /// The upper arm and everything below.
    Arm(Side),
    /// The upper leg and everything below.
    Leg(Side),
}

impl Limb {
    /// All limbs in the order of [`Self::index`].
    pub const ALL: [Self; 5] = [Self::Trunk, Self::Arm(Left), Self::Arm(Right), Self::Leg(Left), Self::Leg(Right)];

    /// The limb's position in [`Self::ALL`].
    pub fn index(self) -> usize {
        match self {
            Self::Trunk => 0,
            Self::Arm(Left) => 1,
            Self::Arm(Right) => 2,
            Self::Leg(Left) => 3,
            Self::Leg(Right) => 4,
        }
    }

    /// The uppermost joint.
    pub fn root(self) -> HumanJoint {
        match self {
            Self::Trunk => Hips,
            Self::Arm(side) => UpperArm(side),
            Self::Leg(side) => UpperLeg(side),
        }
    }

    /// The human joints of this limb, parents first.
    pub fn joints(self) -> impl Iterator<Item = HumanJoint> {
        HumanJoint::BODY.into_iter().filter(move |joint| joint.limb() == self)
    }

    /// In words: `right arm`, `trunk`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Trunk => "trunk",
            Self::Arm(Left) => "left arm",
            Self::Arm(Right) => "right arm",
            Self::Leg(Left) => "left leg",
            Self::Leg(Right) => "right leg",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parents_come_first_and_names_are_read_back() {
        for (k, joint) in HumanJoint::BODY.into_iter().enumerate() {
            assert_eq!(HumanJoint::from_name(joint.name()), Some(joint));
            let above = joint.parent().map(|p| HumanJoint::BODY.iter().position(|&j| j == p).unwrap());
            assert!(above.map_or(k == 0, |a| a < k), "{joint:?}");
        }
        assert_eq!(HumanJoint::from_name("leftIndexProximal"), None);
    }

    #[test]
    fn mirroring_swaps_sides_and_keeps_limb_and_parent() {
        for joint in HumanJoint::BODY {
            let other = joint.mirrored();
            assert_eq!(other.mirrored(), joint);
            assert_eq!(other.side(), joint.side().map(Side::mirrored));
            assert_eq!(other.parent(), joint.parent().map(HumanJoint::mirrored));
            if let Some(side) = joint.side() {
                assert!(joint.name().starts_with(side.name()));
            }
        }
    }

    #[test]
    fn limbs_contain_each_joint_once() {
        for (k, limb) in Limb::ALL.into_iter().enumerate() {
            assert_eq!(limb.index(), k);
            assert_eq!(limb.joints().next(), Some(limb.root()));
        }
        assert_eq!(Limb::ALL.iter().map(|limb| limb.joints().count()).sum::<usize>(), HumanJoint::BODY.len());
        assert_eq!(Limb::Leg(Right).joints().count(), 4);
    }

    #[test]
    fn parts_are_named_in_words() {
        assert_eq!(UpperArm(Right).part_name(), Limb::Arm(Right).name());
        assert_eq!(LowerLeg(Left).part_name(), "left lower leg");
        assert_eq!(words_of("leftIndexProximal"), "left index proximal");
    }
}
