//! Rigs are recognised by their names, and by their structure where the names are unknown.

use super::figure;
use super::rigs::{performance, renamed, with_twist_bones};
use crate::body::HumanJoint;
use crate::body::Side;
use crate::formats::RawMotion;
use crate::motion::alias_tables::TABLES;
use crate::motion::clip::Clip;
use crate::motion::names::map_by_names;
use crate::motion::rig_map::{MIDDLE, OF_SIDE, RigMap};
use crate::motion::structure::map_by_structure;
use crate::motion::{MotionParams, follow};

/// The motion with the names of a rig, after a prefix.
fn named_as(motion: &RawMotion, table: usize, sides: usize, prefix: &str) -> RawMotion {
    let table = &TABLES[table];
    let (left, right) = table.sides[sides];
    renamed(motion, |_, name| {
        let joint = HumanJoint::from_name(name).unwrap();
        let middle = MIDDLE.iter().position(|&j| j == joint).map(|k| (k, ""));
        let place = middle.or_else(|| {
            let side = joint.side()?;
            let k = OF_SIDE.iter().position(|of| of(side) == joint)?;
            Some((k + MIDDLE.len(), if side == Side::Left { left } else { right }))
        });
        let (k, side) = place.unwrap();
        match table.names[k].first() {
            Some(alias) => format!("{prefix}{}", alias.replace('@', side)),
            // The rig has no such joint, so it has any other name.
            None => format!("{prefix}extra {name}"),
        }
    })
}

#[test]
fn every_table_recognises_its_own_names_with_any_prefix() {
    let motion = performance("idle", 60);
    for (k, table) in TABLES.iter().enumerate() {
        for sides in 0..table.sides.len() {
            for prefix in ["", "mixamorig:", "character|rig:", "Bip01 ", "J_Bip_C_"] {
                let clip = Clip::new("x", named_as(&motion, k, sides, prefix));
                let map = map_by_names(&clip).unwrap_or_else(|| panic!("{} after '{prefix}'", table.rig));
                for joint in HumanJoint::BODY {
                    let expected = motion.joints.iter().position(|j| j.name == joint.name());
                    let has = expected.filter(|&j| !clip.joints[j].name.contains("extra"));
                    assert_eq!(map.start(joint), has, "{} as {:?} after '{prefix}': {joint:?}", table.rig, map.rig);
                }
            }
        }
    }
}

#[test]
fn a_prefix_that_lost_its_colon_is_recognised() {
    let mixamo = TABLES.iter().position(|table| table.rig == "Mixamo").unwrap();
    for prefix in ["mixamorig", "mixamorig7"] {
        let clip = Clip::new("x", named_as(&performance("idle", 60), mixamo, 0, prefix));
        assert_eq!(map_by_names(&clip).and_then(|map| map.rig), Some("Mixamo"), "{prefix}");
    }
}

fn by_structure(motion: &RawMotion) -> RigMap {
    let clip = Clip::new("x", renamed(motion, |j, _| format!("bone {j}")));
    assert!(map_by_names(&clip).is_none());
    map_by_structure(&clip).unwrap()
}

#[test]
fn a_skeleton_of_unknown_names_is_recognised_by_its_structure() {
    // Hands and feet have ends: without them, no bone shows how long they are.
    let mut motion = performance("idle", 60);
    for joint in &mut motion.joints {
        joint.end = match joint.name.as_str() {
            "leftHand" | "rightHand" => Some([0.0, -0.18, 0.0]),
            "leftToes" | "rightToes" => Some([0.0, -0.01, 0.06]),
            "head" => Some([0.0, 0.18, 0.0]),
            _ => None,
        };
    }
    let by_name = map_by_names(&Clip::new("x", motion.clone())).unwrap();
    let found = by_structure(&motion);
    for joint in HumanJoint::BODY {
        assert_eq!(found.start(joint), by_name.start(joint), "{joint:?}");
    }
    let split = with_twist_bones(&motion);
    let found = by_structure(&split);
    for joint in HumanJoint::BODY {
        let expected = split.joints.iter().position(|j| j.name == joint.name());
        assert_eq!(found.start(joint), expected, "{joint:?} of limbs with twist bones");
    }
    let clip = Clip::new("x", renamed(&motion, |j, _| format!("bone {j}")));
    let (_, report) = follow(&clip, figure(), None, None, &MotionParams::default()).unwrap();
    assert!(report.findings.iter().any(|f| f.contains("by its structure")), "{:?}", report.findings);
}
