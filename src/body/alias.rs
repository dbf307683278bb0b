//! Other rigs' names for our joints.

use super::JOINT_NAMES;

/// MakeHuman's default rig: the bone whose head is the joint, in the order of [`JOINT_NAMES`].
const MAKEHUMAN: [&str; 22] = [
    "root",
    "spine05",
    "spine03",
    "spine01",
    "neck01",
    "head",
    "clavicle.L",
    "upperarm01.L",
    "lowerarm01.L",
    "wrist.L",
    "clavicle.R",
    "upperarm01.R",
    "lowerarm01.R",
    "wrist.R",
    "upperleg01.L",
    "lowerleg01.L",
    "foot.L",
    "toe1-1.L",
    "upperleg01.R",
    "lowerleg01.R",
    "foot.R",
    "toe1-1.R",
];

/// Our name for a joint that is called so in our own files or in MakeHuman's default rig.
pub fn joint_by_any_name(name: &str) -> Option<&'static str> {
    JOINT_NAMES
        .into_iter()
        .find(|n| *n == name)
        .or_else(|| MAKEHUMAN.iter().position(|n| *n == name).map(|k| JOINT_NAMES[k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_rigs_name_the_same_joint() {
        assert_eq!(joint_by_any_name("leftHand"), Some("leftHand"));
        assert_eq!(joint_by_any_name("wrist.L"), Some("leftHand"));
        assert_eq!(joint_by_any_name("toe1-1.R"), Some("rightToes"));
        assert_eq!(joint_by_any_name("tail"), None);
    }
}
