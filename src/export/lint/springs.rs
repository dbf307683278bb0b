//! Springs of a VRM avatar, by the demands of `VRMC_springBone` 1.0.

use serde_json::Value;
use std::collections::BTreeSet;

fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value[key].as_array().map_or(&[], Vec::as_slice)
}

fn index(value: &Value) -> Option<usize> {
    value.as_u64().map(|index| index as usize)
}

/// What is wrong with chains and colliders. `parents`: the parent of each node.
pub(super) fn springs(extension: &Value, parents: &[Option<usize>]) -> Vec<String> {
    let mut faults = Vec::new();
    let node = |value: &Value| index(&value["node"]).filter(|node| *node < parents.len());
    let colliders = list(extension, "colliders");
    let groups = list(extension, "colliderGroups");
    for (k, collider) in colliders.iter().enumerate() {
        if node(collider).is_none() {
            faults.push(format!("collider {k} is on a node that does not exist"));
        }
        let radius = ["sphere", "capsule"].iter().find_map(|kind| collider["shape"][kind]["radius"].as_f64());
        if radius.is_none_or(|radius| !(1e-3..1.0).contains(&radius)) {
            faults.push(format!("collider {k} has no radius between 1 mm and 1 m"));
        }
        let is_of_group = |group: &Value| list(group, "colliders").iter().any(|own| index(own) == Some(k));
        if !groups.iter().any(is_of_group) {
            faults.push(format!("collider {k} is in no group, so it does nothing"));
        }
    }
    let mut used = BTreeSet::new();
    let mut taken = BTreeSet::new();
    for spring in list(extension, "springs") {
        let name = spring["name"].as_str().unwrap_or_default();
        let joints: Vec<Option<usize>> = list(spring, "joints").iter().map(node).collect();
        if joints.len() < 2 || joints.iter().any(Option::is_none) {
            faults.push(format!("spring '{name}' has less than two joints, or one that does not exist"));
            continue;
        }
        let joints: Vec<usize> = joints.into_iter().flatten().collect();
        if let Some(joint) = joints.iter().find(|joint| !taken.insert(**joint)) {
            faults.push(format!("spring '{name}': node {joint} is in two springs"));
        }
        for pair in joints.windows(2) {
            let mut above = parents[pair[1]];
            while above.is_some_and(|node| node != pair[0]) {
                above = above.and_then(|node| parents[node]);
            }
            if above.is_none() {
                faults.push(format!("spring '{name}': node {} is not below node {}", pair[1], pair[0]));
            }
        }
        for group in list(spring, "colliderGroups") {
            match index(group).filter(|group| *group < groups.len()) {
                Some(group) => drop(used.insert(group)),
                None => faults.push(format!("spring '{name}' names a collider group that does not exist")),
            }
        }
    }
    for k in (0..groups.len()).filter(|k| !used.contains(k)) {
        faults.push(format!("no spring names collider group {k}, so it does nothing"));
    }
    faults
}
