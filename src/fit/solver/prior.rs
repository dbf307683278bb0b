//! Prior knowledge of the joints of a standing person.

use crate::body::HumanJoint::{
    Chest, Hand, Head, LowerArm, LowerLeg, Neck, Shoulder, Spine, Toes, UpperArm, UpperChest, UpperLeg,
};
use crate::body::{HumanJoint, JointId, Side, Skeleton};
use serde::{Deserialize, Serialize};

/// Stiffness of each joint's prior: `strength` / σ², with σ the expected rotation from the prior's centre.
///
/// **Shapes** one value per joint.
///
/// σ in radians: people on a turntable hold spine, collar bones and feet nearly as in the bind pose; shoulders,
/// elbows, hips and knees vary.
pub(crate) fn pose_stiffness(skeleton: &Skeleton, strength: f64) -> Vec<f64> {
    let sigma_of = |joint: JointId| match skeleton.human_joint(joint) {
        Some(UpperArm(_) | LowerArm(_)) => 0.5,
        Some(UpperLeg(_)) => 0.35,
        Some(LowerLeg(_) | Hand(_) | Head | Neck) => 0.2,
        Some(Toes(_)) => 0.06,
        // Spine, collar bones, ankles; fingers keep their pose.
        _ => 0.12,
    };
    skeleton.ids().map(|joint| strength / (sigma_of(joint) * sigma_of(joint))).collect()
}

/// Joints that turn in a coarse fit: enough to align the limbs with the scan. **Shapes** one entry per joint.
pub(crate) fn limbs_only(skeleton: &Skeleton) -> Vec<bool> {
    let turns = |joint: JointId| {
        let human = skeleton.human_joint(joint);
        joint.index() == 0 || matches!(human, Some(UpperArm(_) | LowerArm(_) | UpperLeg(_) | LowerLeg(_) | Spine))
    };
    skeleton.ids().map(turns).collect()
}

/// Joints that may turn, each with its subtree: the chosen joint angles of Hu 2017.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JointGroup {
    /// All joints.
    All,
    /// Both arms, from the collar bones.
    Arms,
    /// Both legs, from the hips.
    Legs,
    /// Arms and legs.
    Limbs,
    /// Neck and head.
    Head,
    /// The spine only.
    Trunk,
}

/// Joints that keep their pose if only a group may turn: all others, and fingers. The root always moves, because the person
/// stands in another place.
///
/// **Shapes** one entry per joint.
pub(crate) fn held_joints(skeleton: &Skeleton, group: JointGroup) -> Vec<bool> {
    let below = |j: JointId, root: fn(Side) -> HumanJoint| Side::BOTH.iter().any(|&s| skeleton.is_part_of(j, root(s)));
    let turns = |j: JointId| match group {
        JointGroup::All => true,
        JointGroup::Arms => below(j, Shoulder),
        JointGroup::Legs => below(j, UpperLeg),
        JointGroup::Limbs => below(j, Shoulder) || below(j, UpperLeg),
        JointGroup::Head => skeleton.is_part_of(j, Neck),
        JointGroup::Trunk => matches!(skeleton.human_joint(j), Some(Spine | Chest | UpperChest)),
    };
    skeleton.ids().map(|j| j.index() != 0 && (!turns(j) || skeleton.is_finger(j))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::HumanJoint::Hips;
    use crate::body::embedded_model;

    #[test]
    fn a_group_frees_its_joints_and_the_root() {
        let skeleton = embedded_model().unwrap().skeleton;
        let free = |group| -> Vec<HumanJoint> {
            let held = held_joints(&skeleton, group);
            skeleton.ids().filter(|j| !held[j.index()]).map(|j| skeleton.human_joint(j).unwrap()).collect()
        };
        assert_eq!(free(JointGroup::All), HumanJoint::BODY);
        assert_eq!(free(JointGroup::Trunk), [Hips, Spine, Chest, UpperChest]);
        let legs = free(JointGroup::Legs);
        assert!(legs.contains(&Hips) && legs.contains(&Toes(Side::Left)) && !legs.contains(&Spine));
        assert!(free(JointGroup::Limbs).iter().all(|&joint| joint != Head && joint != Chest));
    }
}
