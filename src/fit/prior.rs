//! What is known of a standing person's joints before a scan is seen.

use super::FitError;
use crate::body::Skeleton;

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

/// Which joints keep their pose when only those named may turn, each with all below it; none named: none is held. The root
/// always moves: the person has stood up anew.
pub(crate) fn held_joints(skeleton: &Skeleton, turning: &[String]) -> Result<Vec<bool>, FitError> {
    /// Groups by the joints that start them.
    const GROUPS: [(&str, &[&str]); 4] = [
        ("arms", &["leftShoulder", "rightShoulder"]),
        ("legs", &["leftUpperLeg", "rightUpperLeg"]),
        ("head", &["neck"]),
        ("trunk", &["spine", "chest", "upperChest"]),
    ];
    let mut held = vec![!turning.is_empty(); skeleton.len()];
    if let Some(root) = held.first_mut() {
        *root = false;
    }
    for name in turning {
        let group = GROUPS.iter().find(|g| g.0 == name).map(|g| g.1);
        let (starts, alone): (Vec<&str>, bool) = match group {
            Some(names) => (names.to_vec(), name == "trunk"),
            None => (vec![name.as_str()], false),
        };
        for start in starts {
            let joint = skeleton
                .find(start)
                .ok_or_else(|| FitError::UnknownJoint { name: name.clone(), known: skeleton.names.clone() })?;
            for j in skeleton.ids().filter(|&j| if alone { j == joint } else { skeleton.is_below(j, joint) }) {
                held[j.index()] = false;
            }
        }
    }
    Ok(held)
}
