//! Which joints of a clip's skeleton are which human joints.

use super::clip::Clip;
use crate::body::HumanJoint::{
    self, Chest, Foot, Hand, Head, Hips, LowerArm, LowerLeg, Neck, Shoulder, Spine, Toes, UpperArm, UpperChest,
    UpperLeg,
};
use crate::body::Side;
use std::collections::BTreeMap;

/// The joints of a clip's skeleton by human joint.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct RigMap {
    /// The rig whose names were recognised; `None` if the joints were found by the skeleton's structure.
    pub rig: Option<&'static str>,
    /// One or several joints each, from the body outwards.
    joints: BTreeMap<HumanJoint, Vec<usize>>,
    /// The finger joints that turn, by their VRM names.
    pub fingers: BTreeMap<String, usize>,
}

/// What a clip must have at least: with fewer joints, there is no person to follow.
pub(super) const REQUIRED: [fn(Side) -> HumanJoint; 5] = [UpperLeg, LowerLeg, Foot, UpperArm, LowerArm];

impl RigMap {
    pub fn new(rig: Option<&'static str>, joints: BTreeMap<HumanJoint, Vec<usize>>) -> Self {
        let joints = joints.into_iter().filter(|(_, list)| !list.is_empty()).collect();
        Self { rig, joints, fingers: BTreeMap::new() }
    }

    /// Where a human joint is: its first joint.
    pub fn start(&self, joint: HumanJoint) -> Option<usize> {
        self.joints.get(&joint)?.first().copied()
    }

    /// The joint in the middle of those of a human joint: its rotation is about that of the whole chain.
    pub fn middle(&self, joint: HumanJoint) -> Option<usize> {
        let list = self.joints.get(&joint)?;
        Some(list[list.len() / 2])
    }

    /// The number of human joints that were found.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// The first of the required joints that is missing, or that is not below the one above it.
    pub fn gap(&self, clip: &Clip) -> Option<HumanJoint> {
        let hangs = |below: HumanJoint, above: HumanJoint| match (self.start(below), self.start(above)) {
            (Some(below), Some(above)) => below != above && clip.is_below(below, above),
            _ => false,
        };
        for side in Side::BOTH {
            for joint in REQUIRED.map(|joint| joint(side)) {
                let above = joint.parent().filter(|above| REQUIRED.iter().any(|r| r(side) == *above));
                if self.start(joint).is_none() || above.is_some_and(|above| !hangs(joint, above)) {
                    return Some(joint);
                }
            }
        }
        if self.start(Hips).is_none() { Some(Hips) } else { None }
    }
}

/// The human joints of a table of names: six in the middle, then eight for a side.
pub(super) const MIDDLE: [HumanJoint; 6] = [Hips, Spine, Chest, UpperChest, Neck, Head];
pub(super) const OF_SIDE: [fn(Side) -> HumanJoint; 8] =
    [Shoulder, UpperArm, LowerArm, Hand, UpperLeg, LowerLeg, Foot, Toes];
