//! Which joints of a clip's skeleton are which finger joints, and how hands are held in its reference pose.

use super::aligned::smallest_rotation;
use super::clip::Clip;
use super::names::plain;
use crate::body::{Finger, JointId, Side, Skeleton};
use crate::geometry::Vec3;
use nalgebra::UnitQuaternion;
use std::collections::BTreeMap;

/// Words of the fingers' names, from the thumb.
const WORDS: [&[&str]; 5] = [&["thumb"], &["index"], &["mid"], &["ring"], &["pinky", "little"]];
/// Words of bones within the palm, which are no finger's first joint; a thumb has no other.
const OF_PALM: [&str; 2] = ["carpal", "palm"];

/// The joints below a hand of a clip's skeleton by the VRM names of finger joints; fewer where the clip has fewer.
///
/// Names have the finger's word, or `finger` and its number, the thumb's being the least unless a thumb has that word.
pub(super) fn fingers_below(clip: &Clip, hand: usize, side: Side) -> BTreeMap<String, usize> {
    let below: Vec<(usize, String)> = (0..clip.joints.len())
        .filter(|&j| j != hand && clip.is_below(j, hand))
        .map(|j| (j, plain(&clip.joints[j].name)))
        .collect();
    let number = |name: &str| name.split_once("finger")?.1.chars().next()?.to_digit(10);
    let has_thumb = below.iter().any(|(_, name)| name.contains("thumb"));
    let least = below.iter().filter_map(|(_, name)| number(name)).min();
    let index = |name: &str| {
        let by_word = WORDS.iter().position(|words| words.iter().any(|word| name.contains(word)));
        by_word.or_else(|| Some((number(name)? - least?) as usize + usize::from(has_thumb)))
    };
    let mut joints = BTreeMap::new();
    for (k, finger) in Finger::ALL.into_iter().enumerate() {
        // Joints are listed after their parents. Of two with the same name, the first only connects the second.
        let mut chain: Vec<&(usize, String)> = Vec::new();
        for joint in &below {
            let is_in_palm = finger != Finger::Thumb && OF_PALM.iter().any(|word| joint.1.contains(word));
            if index(&joint.1) != Some(k) || is_in_palm {
                continue;
            }
            if chain.last().is_some_and(|last| last.1 == joint.1) {
                chain.pop();
            }
            chain.push(joint);
        }
        joints.extend(finger.joint_names(side).into_iter().zip(chain.into_iter().map(|joint| joint.0)));
    }
    joints
}

/// Turns the bones of fingers to those of a reference pose: hands of rigs rest flat, relaxed or as fists. A last bone, of which
/// nothing marks the end, turns with the one above.
///
/// **Shapes** `turned`: one rotation from the bind pose per joint. `place` is that of a finger joint in the reference pose, `None` for
/// other joints.
pub(super) fn align_fingers(
    skeleton: &Skeleton,
    turned: &mut [UnitQuaternion<f64>],
    place: impl Fn(JointId) -> Option<Vec3>,
) {
    for j in skeleton.ids() {
        let (Some(start), Some(parent)) = (place(j), skeleton.parents[j.index()]) else { continue };
        let above = turned[parent.index()];
        let next = skeleton.ids().find(|&next| skeleton.parents[next.index()] == Some(j));
        turned[j.index()] = match next.and_then(|next| Some((next, place(next)?))) {
            Some((next, end)) => {
                let bone = skeleton.joints_in_bind[next.index()] - skeleton.joints_in_bind[j.index()];
                smallest_rotation(&(above * bone), &(end - start)) * above
            }
            None => above,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{RawJoint, RawMotion, RawTransform};

    /// A hand with chains of the given names.
    fn hand(chains: &[&[&str]]) -> Clip {
        let joint = |name: &str, parent| RawJoint {
            name: name.into(),
            parent,
            rest: RawTransform::translated([0.1, 0.0, 0.0]),
            end: None,
        };
        let mut joints = vec![joint("LeftHand", None)];
        for chain in chains {
            for (k, name) in chain.iter().enumerate() {
                let above = if k == 0 { 0 } else { joints.len() - 1 };
                joints.push(joint(name, Some(above)));
            }
        }
        let frame = joints.iter().map(|joint| joint.rest).collect();
        Clip::new("x", RawMotion { name: None, joints, frame_secs: Some(0.1), frames: vec![frame], notes: Vec::new() })
    }

    #[test]
    fn fingers_of_rigs_are_found_by_word_or_number() {
        let rigs: [&[&[&str]]; 6] = [
            &[
                &["LeftHandThumb1", "LeftHandThumb2", "LeftHandThumb3", "LeftHandThumb4"],
                &["LeftHandIndex1", "LeftHandIndex2", "LeftHandIndex3"],
                &["LeftHandMiddle1", "LeftHandMiddle2"],
            ],
            &[
                &["thumb_01_l", "thumb_02_l", "thumb_03_l"],
                &["index_metacarpal_l", "index_01_l", "index_02_l", "index_03_l"],
                &["middle_metacarpal_l", "middle_01_l", "middle_02_l"],
            ],
            &[
                &["finger1-1.L", "finger1-2.L", "finger1-3.L"],
                &["metacarpal1.L", "finger2-1.L", "finger2-2.L", "finger2-3.L"],
                &["metacarpal2.L", "finger3-1.L", "finger3-2.L"],
            ],
            &[
                &["Bip01 L Finger0", "Bip01 L Finger01", "Bip01 L Finger02"],
                &["Bip01 L Finger1", "Bip01 L Finger11", "Bip01 L Finger12"],
                &["Bip01 L Finger2", "Bip01 L Finger21"],
            ],
            &[
                &["__Thumb1_L", "Thumb1_L", "Thumb2_L", "Thumb3_L"],
                &["f_index.01.L", "f_index.02.L", "f_index.03.L"],
                &["lMid1", "lMid2"],
            ],
            &[&["LThumb", "LThumb2", "LThumb3"], &["LFinger1", "LFinger12", "LFinger13"], &["LFinger2", "LFinger22"]],
        ];
        for rig in rigs {
            let clip = hand(rig);
            let found = fingers_below(&clip, 0, Side::Left);
            let name = |key: &str| found.get(key).map(|&j| clip.joints[j].name.as_str());
            assert_eq!(found.len(), 8, "{found:?}");
            let thumb = rig[0].iter().position(|name| !name.starts_with("__")).unwrap();
            for (k, key) in Finger::Thumb.joint_names(Side::Left).iter().enumerate() {
                assert_eq!(name(key), Some(rig[0][thumb + k]));
            }
            let index = &rig[1][rig[1].len() - 3..];
            assert_eq!(Finger::Index.joint_names(Side::Left).map(|key| name(&key).unwrap().to_string())[..], index[..]);
            assert_eq!(name("leftMiddleIntermediate"), rig[2].last().copied());
        }
        assert!(fingers_below(&hand(&[]), 0, Side::Left).is_empty());
    }
}
