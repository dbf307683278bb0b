//! The frames of the VMC protocol as the motion of a skeleton.
//!
//! The protocol sends no hierarchy: the parents are those of VRM 1.0, or the next ones above that are sent. It sends no rest
//! pose either: it is the T-pose, in which no bone is rotated, with the places of the first frame.

use super::stream::VmcFrame;
use crate::body::HumanJoint::{self, Foot, Hips, LowerArm, LowerLeg, UpperArm, UpperLeg};
use crate::body::Side;
use crate::formats::{RawJoint, RawMotion, RawTransform};

/// Frames per second that senders have unless they tell the time.
const USUAL_FPS: f64 = 30.0;

/// The skeleton of a sender, with the last transform of each bone.
///
/// **Guarantees** the joints are those of [`VmcRig::motion`]: the root, then the bones, parents first.
#[derive(Clone, Debug)]
pub struct VmcRig {
    bones: Vec<HumanJoint>,
    rest: Vec<RawJoint>,
    last: Vec<RawTransform>,
}

impl VmcRig {
    /// The bones without which a frame has no skeleton of a person, of those that it does not have.
    pub fn missing(frame: &VmcFrame) -> Vec<HumanJoint> {
        let of_side = |side| [UpperLeg(side), LowerLeg(side), Foot(side), UpperArm(side), LowerArm(side)];
        let required = std::iter::once(Hips).chain(Side::BOTH.into_iter().flat_map(of_side));
        required.filter(|joint| find(frame, *joint).is_none()).collect()
    }

    /// The skeleton of a frame; `None` if required bones are missing. Bones that it does not have are ignored later, too.
    pub fn of(frame: &VmcFrame) -> Option<Self> {
        if !Self::missing(frame).is_empty() {
            return None;
        }
        let bones: Vec<HumanJoint> =
            HumanJoint::BODY.into_iter().filter(|joint| find(frame, *joint).is_some()).collect();
        let still = RawTransform::translated([0.0; 3]);
        let root = RawJoint { name: "root".into(), parent: None, rest: still, end: None };
        let mut rig = Self { rest: vec![root], last: vec![still; 1 + bones.len()], bones };
        rig.next(frame);
        for (k, bone) in rig.bones.iter().enumerate() {
            let mut above = std::iter::successors(bone.parent(), |joint| joint.parent());
            let parent = above.find_map(|joint| rig.bones.iter().position(|b| *b == joint));
            let parent = parent.map_or(0, |position| 1 + position);
            let rest = RawTransform::translated(rig.last[1 + k].translation);
            rig.rest.push(RawJoint { name: bone.name().into(), parent: Some(parent), rest, end: None });
        }
        Some(rig)
    }

    /// The skeleton in the T-pose, with the last frame.
    pub fn motion(&self) -> RawMotion {
        RawMotion {
            name: None,
            joints: self.rest.clone(),
            frame_secs: Some(1.0 / USUAL_FPS),
            frames: vec![self.last.clone()],
            notes: Vec::new(),
        }
    }

    /// The transforms of a frame, relative to the parents. Bones that are missing stay as they were.
    ///
    /// **Shapes** one transform per joint of [`VmcRig::motion`].
    pub fn next(&mut self, frame: &VmcFrame) -> &[RawTransform] {
        if let Some((translation, rotation)) = frame.root {
            self.last[0] = RawTransform { translation, rotation };
        }
        for (bone, last) in self.bones.iter().zip(&mut self.last[1..]) {
            if let Some(found) = find(frame, *bone) {
                *last = found;
            }
        }
        &self.last
    }
}

fn find(frame: &VmcFrame, joint: HumanJoint) -> Option<RawTransform> {
    let (_, translation, rotation) = frame.bones.iter().find(|(name, ..)| *name == joint.name())?;
    Some(RawTransform { translation: *translation, rotation: *rotation })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Figure, Pose, Skeleton, embedded_model};
    use crate::geometry::Vec3;
    use crate::motion::{Clip, LiveRetargeter, MotionParams, built_in_clip, follow};
    use nalgebra::UnitQuaternion;

    type Turn = UnitQuaternion<f64>;

    fn figure() -> Figure {
        let model = embedded_model().unwrap();
        let (mesh, skeleton) = model.shaped(&model.mean_shape());
        Figure::bare(skeleton, mesh, model.weights.clone())
    }

    fn only_retargeted() -> MotionParams {
        MotionParams { ease_secs: 0.0, plant: false, limits: false, clear: false }
    }

    /// Per joint the rotation from the bind pose to a T-pose: arms to the sides, legs straight down.
    fn to_t_pose(skeleton: &Skeleton) -> Vec<Turn> {
        let mut turns: Vec<Turn> = Vec::new();
        for j in skeleton.ids() {
            let above = skeleton.parents[j.index()].map_or_else(Turn::identity, |p| turns[p.index()]);
            let wanted = match skeleton.human_joint(j) {
                Some(UpperArm(side) | LowerArm(side)) => Vec3::x() * side.sign(),
                Some(UpperLeg(_) | LowerLeg(_)) => -Vec3::y(),
                Some(HumanJoint::Hand(_)) => {
                    turns.push(above);
                    continue;
                }
                _ => {
                    turns.push(Turn::identity());
                    continue;
                }
            };
            let end = skeleton.bone_end(j).unwrap();
            let bone = above * (skeleton.joints_in_bind[end.index()] - skeleton.joints_in_bind[j.index()]);
            turns.push(Turn::rotation_between(&bone, &wanted).unwrap() * above);
        }
        turns
    }

    /// Poses of a figure as a sender sends them whose avatar is the figure in a T-pose.
    fn sent(skeleton: &Skeleton, poses: &[Pose]) -> Vec<VmcFrame> {
        let turns = to_t_pose(skeleton);
        let of_pose = |(frame, pose): (usize, &Pose)| {
            let world = skeleton.world_from_bind(pose);
            let bone = |j: crate::body::JointId| {
                let in_bind = skeleton.joints_in_bind[j.index()];
                let own = world[j.index()].rotation * turns[j.index()].inverse();
                let (place, rotation) = match skeleton.parents[j.index()] {
                    Some(parent) => {
                        let p = parent.index();
                        let above = world[p].rotation * turns[p].inverse();
                        (turns[p] * (in_bind - skeleton.joints_in_bind[p]), above.inverse() * own)
                    }
                    None => ((world[0] * in_bind).coords, own),
                };
                (skeleton.names[j.index()].clone(), place.into(), rotation.into_inner().coords.into())
            };
            VmcFrame {
                secs: Some(frame as f64 / 30.0),
                root: Some(([0.0; 3], [0.0, 0.0, 0.0, 1.0])),
                bones: skeleton.ids().map(bone).collect(),
            }
        };
        poses.iter().enumerate().map(of_pose).collect()
    }

    fn greatest_angle(found: &[Pose], expected: &[Pose]) -> f64 {
        let pairs = found.iter().zip(expected).flat_map(|(a, b)| a.rotations.iter().zip(&b.rotations));
        pairs.map(|(a, b)| a.angle_to(b)).fold(0.0, f64::max)
    }

    #[test]
    fn a_walk_that_is_sent_is_the_walk() {
        let figure = figure();
        let clip = built_in_clip("walk").unwrap();
        let walk = follow(&clip, &figure, None, None, &only_retargeted()).unwrap().0.poses;
        let limited = follow(&clip, &figure, None, None, &MotionParams { limits: true, ..only_retargeted() });
        let limited = limited.unwrap().0.poses;
        let frames = sent(&figure.skeleton, &walk);
        let mut rig = VmcRig::of(&frames[0]).unwrap();
        let mut whole = rig.motion();
        let live = LiveRetargeter::try_new(&figure.skeleton, rig.motion()).unwrap();
        assert!(live.recognition().contains("as VRM: 22 of 22 joints; metres, Y up"), "{}", live.recognition());
        let mut found = Vec::new();
        for frame in &frames {
            found.push(live.pose(rig.next(frame)));
            whole.frames.push(rig.last.clone());
        }
        whole.frames.remove(0);
        // As the figure moved, kept within the limits.
        assert!(greatest_angle(&found, &limited) < 1e-6, "{} rad", greatest_angle(&found, &limited));
        // The same as a clip of all the frames.
        let params = MotionParams { limits: true, ..only_retargeted() };
        let clip = follow(&Clip::new("sent", whole), &figure, None, None, &params).unwrap().0.poses;
        assert!(greatest_angle(&found, &clip) < 1e-6, "{} rad", greatest_angle(&found, &clip));
        for (pose, expected) in found.iter().zip(&walk) {
            assert!((pose.translation - expected.translation).norm() < 1e-6, "the hips are where they were sent from");
        }
    }

    #[test]
    fn the_place_may_be_sent_with_the_root() {
        let figure = figure();
        let walk = follow(&built_in_clip("walk").unwrap(), &figure, None, None, &only_retargeted()).unwrap().0.poses;
        let frames = sent(&figure.skeleton, &walk[..40]);
        let by_root: Vec<VmcFrame> = frames
            .iter()
            .cloned()
            .map(|mut frame| {
                let [x, y, z] = frame.bones[0].1;
                frame.root = Some(([x, 0.0, z], [0.0, 0.0, 0.0, 1.0]));
                frame.bones[0].1 = [0.0, y, 0.0];
                frame
            })
            .collect();
        let played = |frames: &[VmcFrame]| {
            let mut rig = VmcRig::of(&frames[0]).unwrap();
            let live = LiveRetargeter::try_new(&figure.skeleton, rig.motion()).unwrap();
            frames.iter().map(|frame| live.pose(rig.next(frame))).collect::<Vec<_>>()
        };
        for (a, b) in played(&frames).iter().zip(&played(&by_root)) {
            assert!((a.translation - b.translation).norm() < 1e-9);
            assert!(greatest_angle(std::slice::from_ref(a), std::slice::from_ref(b)) < 1e-6);
        }
    }

    #[test]
    fn bones_that_are_missing_keep_their_last_value() {
        let figure = figure();
        let mut pose = Pose::bind(figure.skeleton.len());
        let arm = figure.skeleton.find(LowerArm(Side::Left)).unwrap();
        pose.rotations[arm.index()] = Turn::from_scaled_axis(Vec3::new(0.0, -0.7, 0.0));
        let frames = sent(&figure.skeleton, &[Pose::bind(figure.skeleton.len()), pose]);
        let mut rig = VmcRig::of(&frames[0]).unwrap();
        let whole = rig.next(&frames[1]).to_vec();
        let mut part = frames[0].clone();
        part.root = None;
        part.bones.retain(|(name, ..)| name == "hips");
        part.bones.push(("leftIndexProximal".into(), [0.0; 3], [0.0, 0.0, 0.0, 1.0]));
        let kept = rig.next(&part).to_vec();
        assert_eq!(kept[2..], whole[2..]);
        assert_eq!(kept.len(), rig.motion().joints.len());
    }

    #[test]
    fn a_skeleton_without_optional_bones_is_a_skeleton() {
        let figure = figure();
        let frame = sent(&figure.skeleton, &[Pose::bind(figure.skeleton.len())]).remove(0);
        let mut least = frame.clone();
        let optional = ["chest", "upperChest", "neck", "leftShoulder", "rightShoulder", "leftToes", "rightToes"];
        least.bones.retain(|(name, ..)| !optional.contains(&name.as_str()));
        least.bones.reverse();
        let rig = VmcRig::of(&least).unwrap();
        let motion = rig.motion();
        let parent = |name: &str| {
            let joint = motion.joints.iter().find(|joint| joint.name == name).unwrap();
            motion.joints[joint.parent.unwrap()].name.clone()
        };
        assert_eq!(["hips", "spine", "head", "leftUpperArm"].map(parent), ["root", "hips", "spine", "spine"]);
        assert!(LiveRetargeter::try_new(&figure.skeleton, motion).is_ok());
        let mut armless = frame;
        armless.bones.retain(|(name, ..)| name != "leftLowerArm");
        assert_eq!(VmcRig::missing(&armless), [LowerArm(Side::Left)]);
        assert!(VmcRig::of(&armless).is_none());
    }
}
