//! What is known of a standing person's joints before a scan is seen.

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
