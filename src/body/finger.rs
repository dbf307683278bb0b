//! Fingers: their joints, and the synergies that bend them together.

use super::human_joint::{HumanJoint, Side};
use super::{JointId, Pose, Skeleton};
use crate::geometry::{Point, Vec3};
use nalgebra::{Unit, UnitQuaternion};
use serde::{Deserialize, Serialize};

/// One of the five fingers of a hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Finger {
    /// The thumb.
    Thumb,
    /// The finger beside the thumb.
    Index,
    /// The longest finger.
    Middle,
    /// The finger between middle and little one.
    Ring,
    /// The smallest finger.
    Little,
}

use Finger::{Index, Little, Middle, Ring, Thumb};

impl Finger {
    /// All fingers of a hand, from the thumb.
    pub const ALL: [Self; 5] = [Thumb, Index, Middle, Ring, Little];

    /// The VRM names of its joints, from the hand to the tip.
    pub fn joint_names(self, side: Side) -> [String; 3] {
        let (finger, joints) = match self {
            Thumb => ("Thumb", ["Metacarpal", "Proximal", "Distal"]),
            Index => ("Index", ["Proximal", "Intermediate", "Distal"]),
            Middle => ("Middle", ["Proximal", "Intermediate", "Distal"]),
            Ring => ("Ring", ["Proximal", "Intermediate", "Distal"]),
            Little => ("Little", ["Proximal", "Intermediate", "Distal"]),
        };
        joints.map(|joint| format!("{}{finger}{joint}", side.name()))
    }

    /// The VRM names of all finger joints of both hands, left first: the order of the embedded body's skeleton.
    pub fn all_joint_names() -> impl Iterator<Item = String> {
        let of_hand = |side| Self::ALL.into_iter().flat_map(move |finger| finger.joint_names(side));
        Side::BOTH.into_iter().flat_map(of_hand)
    }

    /// By how much its joints bend in a fist, from relaxed, in degrees.
    ///
    /// **Source** AAOS: knuckles bend by 90°, then 100° and 70° (thumb 50° and 80°), less what a relaxed hand is bent already.
    fn bend_in_fist(self) -> [f64; 3] {
        match self {
            Thumb => [25.0, 45.0, 55.0],
            _ => [78.0, 85.0, 48.0],
        }
    }

    /// By how much it goes away from the middle finger, towards the thumb, when the hand is spread, from relaxed, in degrees.
    fn spread(self) -> f64 {
        match self {
            Thumb => 20.0,
            Index => 9.0,
            Middle => 1.0,
            Ring => -6.0,
            Little => -12.0,
        }
    }
}

/// How a hand is held, as shares of three synergies; zero is the bind pose.
///
/// **Source** Santello 1998: most of how people hold objects is the bend of all fingers together, then their spread; the thumb
/// has one of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Grasp {
    /// Bend of the four fingers: 1 is a fist, −0.15 a flat hand.
    pub curl: f64,
    /// 1: fingers as far from each other as they go; −1: side by side.
    pub spread: f64,
    /// Bend of the thumb: 1 is that of a fist.
    pub thumb: f64,
}

impl Grasp {
    /// As in the bind pose.
    pub const RELAXED: Self = Self { curl: 0.0, spread: 0.0, thumb: 0.0 };
    /// All fingers stretched.
    pub const FLAT: Self = Self { curl: -0.15, spread: 0.0, thumb: -0.15 };
    /// The fingertips in the palm.
    pub const FIST: Self = Self { curl: 1.0, spread: -0.8, thumb: 0.8 };
    /// The grasps that have a name.
    pub const NAMED: [(&'static str, Self); 3] =
        [("relaxed", Self::RELAXED), ("flat", Self::FLAT), ("fist", Self::FIST)];
    /// Bounds of curl, spread and thumb.
    pub const LIMITS: [[f64; 2]; 3] = [[-0.3, 1.1], [-1.2, 1.5], [-0.5, 1.2]];

    /// Curl, spread, thumb.
    pub fn shares(&self) -> [f64; 3] {
        [self.curl, self.spread, self.thumb]
    }

    /// With these values of curl, spread and thumb, within their limits.
    pub fn within_limits([curl, spread, thumb]: [f64; 3]) -> Self {
        let [of_curl, of_spread, of_thumb] = Self::LIMITS;
        Self {
            curl: curl.clamp(of_curl[0], of_curl[1]),
            spread: spread.clamp(of_spread[0], of_spread[1]),
            thumb: thumb.clamp(of_thumb[0], of_thumb[1]),
        }
    }
}

/// A finger joint and how the synergies turn it.
#[derive(Clone, Debug)]
struct FingerJoint {
    joint: JointId,
    /// Which of [`Grasp::shares`] bends it.
    bent_by: usize,
    /// Axis in the bind pose, times the angle of a fist in radians.
    bend: Vec3,
    /// Axis in the bind pose, times the angle of a spread hand in radians.
    spread: Vec3,
}

impl FingerJoint {
    fn spread_turn(&self, grasp: &Grasp) -> UnitQuaternion<f64> {
        UnitQuaternion::from_scaled_axis(self.spread * grasp.spread)
    }

    /// The finger bends, and then leaves its neighbour.
    fn rotation(&self, grasp: &Grasp) -> UnitQuaternion<f64> {
        self.spread_turn(grasp) * UnitQuaternion::from_scaled_axis(self.bend * grasp.shares()[self.bent_by])
    }
}

/// The finger joints of one hand of a skeleton.
#[derive(Clone, Debug)]
pub struct HandJoints {
    /// The wrist.
    pub hand: JointId,
    joints: Vec<FingerJoint>,
}

impl HandJoints {
    /// `None` unless the skeleton has all fifteen finger joints of this hand.
    pub fn find(skeleton: &Skeleton, side: Side) -> Option<Self> {
        let hand = skeleton.find(HumanJoint::Hand(side))?;
        let found = |finger: Finger| -> Option<[JointId; 3]> {
            let [a, b, c] = finger.joint_names(side);
            Some([skeleton.find_name(&a)?, skeleton.find_name(&b)?, skeleton.find_name(&c)?])
        };
        let at = |joint: JointId| -> Point { skeleton.joints_in_bind[joint.index()] };
        let (index, little) = (at(found(Index)?[0]), at(found(Little)?[0]));
        // Of the left hand; the right one is its mirror image.
        let dorsal = (index - at(hand)).cross(&(little - at(hand))).try_normalize(1e-9)? * side.sign();
        let mut joints = Vec::with_capacity(15);
        for finger in Finger::ALL {
            let ids = found(finger)?;
            for (k, (&joint, degrees)) in ids.iter().zip(finger.bend_in_fist()).enumerate() {
                // The bone that turns; the last one continues that before it.
                let (from, to) = if k < 2 { (ids[k], ids[k + 1]) } else { (ids[1], ids[2]) };
                let bone = at(to) - at(from);
                let (bent_by, inward) = match finger {
                    // The thumb bends across the palm, below the fingers.
                    Thumb => (2, little.lerp(&index, 0.3) - dorsal * 0.3 * (index - little).norm() - at(ids[1])),
                    _ => (0, -dorsal),
                };
                let axis = Unit::try_new(bone.cross(&inward), 1e-12)?;
                let spread = if k == 0 { finger.spread().to_radians() } else { 0.0 };
                joints.push(FingerJoint {
                    joint,
                    bent_by,
                    bend: axis.into_inner() * degrees.to_radians(),
                    spread: dorsal * (-spread * side.sign()),
                });
            }
        }
        Some(Self { hand, joints })
    }

    /// All finger joints of the hand.
    pub fn fingers(&self) -> impl Iterator<Item = JointId> {
        self.joints.iter().map(|finger| finger.joint)
    }

    /// Sets the finger joints of a pose.
    pub fn apply(&self, grasp: &Grasp, pose: &mut Pose) {
        for finger in &self.joints {
            pose.rotations[finger.joint.index()] = finger.rotation(grasp);
        }
    }

    /// By how much each joint turns, in the axes of its parent's bone, for a small change of each of [`Grasp::shares`].
    ///
    /// **Shapes** one entry per finger joint: the joint, and three rotation vectors.
    pub fn turns(&self, grasp: &Grasp) -> impl Iterator<Item = (JointId, [Vec3; 3])> {
        self.joints.iter().map(|finger| {
            let mut turns = [Vec3::zeros(), finger.spread, Vec3::zeros()];
            turns[finger.bent_by] = finger.spread_turn(grasp) * finger.bend;
            (finger.joint, turns)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::embedded_model;

    #[test]
    fn a_fist_brings_the_tips_to_the_palm_and_both_hands_mirror_each_other() {
        let skeleton = embedded_model().unwrap().skeleton;
        let mut pose = Pose::bind(skeleton.len());
        for side in Side::BOTH {
            HandJoints::find(&skeleton, side).unwrap().apply(&Grasp::FIST, &mut pose);
        }
        let (open, closed) = (&skeleton.joints_in_bind, skeleton.joints_in_world(&pose));
        for side in Side::BOTH {
            let hand = skeleton.find(HumanJoint::Hand(side)).unwrap();
            for finger in [Index, Middle, Ring, Little] {
                let tip = skeleton.find_name(&finger.joint_names(side)[2]).unwrap();
                let reach = |joints: &[Point]| (joints[tip.index()] - joints[hand.index()]).norm();
                assert!(reach(&closed) < 0.62 * reach(open), "{finger:?}: {} of {}", reach(&closed), reach(open));
            }
        }
        for joint in skeleton.ids() {
            if let Some(other) = skeleton.mirrored(joint) {
                let (a, b) = (closed[joint.index()], closed[other.index()]);
                assert!((Point::new(-a.x, a.y, a.z) - b).norm() < 1e-6, "{}", skeleton.names[joint.index()]);
            }
        }
    }

    #[test]
    fn turns_are_those_of_small_changes() {
        let skeleton = embedded_model().unwrap().skeleton;
        let hand = HandJoints::find(&skeleton, Side::Right).unwrap();
        let at = Grasp { curl: 0.6, spread: 0.4, thumb: -0.2 };
        let step = 1e-6;
        for k in 0..3 {
            let moved = |sign: f64| {
                let mut shares = at.shares();
                shares[k] += sign * step;
                let mut pose = Pose::bind(skeleton.len());
                hand.apply(&Grasp { curl: shares[0], spread: shares[1], thumb: shares[2] }, &mut pose);
                pose
            };
            let (before, after) = (moved(-1.0), moved(1.0));
            for (joint, turns) in hand.turns(&at) {
                let j = joint.index();
                let numeric = (after.rotations[j] * before.rotations[j].inverse()).scaled_axis() / (2.0 * step);
                assert!((numeric - turns[k]).norm() < 1e-6, "{}: {numeric} against {}", skeleton.names[j], turns[k]);
            }
        }
    }
}
