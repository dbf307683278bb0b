//! What is known of a standing person's joints before a scan is seen.

use crate::body::{JointId, Skeleton};
use serde::{Deserialize, Serialize};

/// Expected turn of each joint away from the centre of the prior, as 1/σ² times `strength`.
///
/// σ in radians: people on a turntable hold spine, collar bones and feet nearly as in the bind pose; shoulders,
/// elbows, hips and knees vary.
pub(crate) fn pose_stiffness(skeleton: &Skeleton, strength: f64) -> Vec<f64> {
    skeleton
        .names
        .iter()
        .map(|name| {
            let sigma = if name.contains("UpperArm") || name.contains("LowerArm") {
                0.5
            } else if name.contains("UpperLeg") {
                0.35
            } else if name.contains("LowerLeg") || name.contains("Hand") || name == "head" || name == "neck" {
                0.2
            } else if name.contains("Toes") {
                0.06
            } else {
                // spine, chest, upperChest, collar bones, ankles, fingers of larger rigs
                0.12
            };
            strength / (sigma * sigma)
        })
        .collect()
}

/// Joints that turn in a coarse fit: enough to lay the limbs into the scan's.
pub(crate) fn limbs_only(skeleton: &Skeleton) -> Vec<bool> {
    skeleton
        .names
        .iter()
        .enumerate()
        .map(|(j, name)| {
            j == 0
                || ["UpperArm", "LowerArm", "UpperLeg", "LowerLeg"].iter().any(|part| name.contains(part))
                || name == "spine"
        })
        .collect()
}

/// Joints that may turn, each with all below it: the chosen joint angles of Hu 2017.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JointGroup {
    /// All.
    All,
    /// From the collar bones on.
    Arms,
    /// From the hips on.
    Legs,
    /// Arms and legs.
    Limbs,
    /// Neck and head.
    Head,
    /// The spine alone.
    Trunk,
}

/// Which joints keep their pose where only a group may turn. The root always moves: the person has stood up anew.
pub(crate) fn held_joints(skeleton: &Skeleton, group: JointGroup) -> Vec<bool> {
    const ARMS: [&str; 2] = ["leftShoulder", "rightShoulder"];
    const LEGS: [&str; 2] = ["leftUpperLeg", "rightUpperLeg"];
    const SPINE: [&str; 3] = ["spine", "chest", "upperChest"];
    let below = |j: JointId, starts: &[&str]| {
        starts.iter().filter_map(|name| skeleton.find_name(name)).any(|start| skeleton.is_below(j, start))
    };
    let turns = |j: JointId| match group {
        JointGroup::All => true,
        JointGroup::Arms => below(j, &ARMS),
        JointGroup::Legs => below(j, &LEGS),
        JointGroup::Limbs => below(j, &ARMS) || below(j, &LEGS),
        JointGroup::Head => below(j, &["neck"]),
        JointGroup::Trunk => SPINE.contains(&skeleton.names[j.index()].as_str()),
    };
    skeleton.ids().map(|j| j.index() != 0 && !turns(j)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::embedded_model;

    #[test]
    fn a_group_frees_its_joints_and_the_root() {
        let skeleton = embedded_model().unwrap().skeleton;
        let free = |group| -> Vec<String> {
            let held = held_joints(&skeleton, group);
            skeleton.ids().filter(|j| !held[j.index()]).map(|j| skeleton.names[j.index()].clone()).collect()
        };
        assert_eq!(free(JointGroup::All).len(), skeleton.len());
        assert_eq!(free(JointGroup::Trunk), ["hips", "spine", "chest", "upperChest"]);
        let legs = free(JointGroup::Legs);
        assert!(legs.contains(&"hips".into()) && legs.contains(&"leftToes".into()) && !legs.contains(&"spine".into()));
        assert!(free(JointGroup::Limbs).iter().all(|name| name != "head" && name != "chest"));
    }
}
