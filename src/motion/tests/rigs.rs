//! Motions on rigs of other makes: the same performance with other rest poses, axes, units, bones and names.

use crate::body::HumanJoint::{LowerArm, LowerLeg, UpperArm, UpperLeg};
use crate::body::Side;
use crate::formats::{RawJoint, RawMotion, RawTransform};
use crate::geometry::Vec3;
use crate::motion::built_in::built_in_motion;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

pub type Turn = UnitQuaternion<f64>;

/// Every `step`th frame of one of our clips, on its own rig with VRM names.
pub fn performance(name: &str, step: usize) -> RawMotion {
    let mut motion = built_in_motion(name).unwrap();
    motion.frames = motion.frames.into_iter().step_by(step).collect();
    motion.frame_secs = motion.frame_secs.map(|secs| secs * step as f64);
    motion
}

pub fn isometry(t: &RawTransform) -> Isometry3<f64> {
    let rotation = Turn::new_normalize(Quaternion::from(t.rotation));
    Isometry3::from_parts(Translation3::from(Vec3::from(t.translation)), rotation)
}

fn raw(t: &Isometry3<f64>) -> RawTransform {
    RawTransform { translation: t.translation.vector.into(), rotation: t.rotation.into_inner().coords.into() }
}

/// Forward kinematics, as a textbook has it: by recursion from each joint to its parent.
pub fn world_of(motion: &RawMotion, frame: usize, joint: usize) -> Isometry3<f64> {
    let own = isometry(&motion.frames[frame][joint]);
    match motion.joints[joint].parent {
        Some(parent) => world_of(motion, frame, parent) * own,
        None => own,
    }
}

pub fn index_of(motion: &RawMotion, name: &str) -> usize {
    motion.joints.iter().position(|joint| joint.name == name).unwrap_or_else(|| panic!("no joint '{name}'"))
}

/// The motion on a rig of which a pose other than the neutral one is without rotations: BVH files have any.
pub fn with_rest(motion: &RawMotion, turned: impl Fn(&str) -> Turn) -> RawMotion {
    let mut rested = motion.clone();
    let rest: Vec<Turn> = motion.joints.iter().map(|joint| turned(&joint.name)).collect();
    let count = motion.joints.len();
    for j in 0..count {
        let above = motion.joints[j].parent.map_or_else(Turn::identity, |parent| rest[parent]);
        let offset = above * Vec3::from(motion.joints[j].rest.translation);
        rested.joints[j].rest = RawTransform::translated(offset.into());
    }
    for (frame, own) in rested.frames.iter_mut().enumerate() {
        let world: Vec<Turn> = (0..count).map(|j| world_of(motion, frame, j).rotation * rest[j].inverse()).collect();
        for j in 0..count {
            let above = motion.joints[j].parent.map(|parent| world[parent]);
            let local = above.map_or(world[j], |above| above.inverse() * world[j]);
            let translation = match above {
                Some(_) => rested.joints[j].rest.translation,
                None => motion.frames[frame][j].translation,
            };
            own[j] = RawTransform { translation, rotation: local.into_inner().coords.into() };
        }
    }
    rested
}

/// Arms level to the sides, as in a T-pose.
pub fn t_pose(name: &str) -> Turn {
    let level = |sign: f64| Turn::from_axis_angle(&Vec3::z_axis(), sign * 90f64.to_radians());
    match name {
        "leftUpperArm" | "leftLowerArm" | "leftHand" => level(1.0),
        "rightUpperArm" | "rightLowerArm" | "rightHand" => level(-1.0),
        _ => Turn::identity(),
    }
}

/// Arms 45° down and 20° forward, feet turned out.
pub fn a_pose(name: &str) -> Turn {
    let arm = |sign: f64| {
        Turn::from_axis_angle(&Vec3::z_axis(), sign * 45f64.to_radians())
            * Turn::from_axis_angle(&Vec3::x_axis(), -20f64.to_radians())
    };
    let leg = |sign: f64| Turn::from_axis_angle(&Vec3::z_axis(), sign * 8f64.to_radians());
    match name {
        "leftUpperArm" | "leftLowerArm" | "leftHand" => arm(1.0),
        "rightUpperArm" | "rightLowerArm" | "rightHand" => arm(-1.0),
        "leftUpperLeg" | "leftLowerLeg" => leg(1.0),
        "rightUpperLeg" | "rightLowerLeg" => leg(-1.0),
        _ => Turn::identity(),
    }
}

/// The motion in other axes and another unit.
pub fn placed(motion: &RawMotion, turn: &Turn, scale: f64) -> RawMotion {
    let moved = |t: &RawTransform| {
        let own = isometry(t);
        RawTransform {
            translation: (turn * own.translation.vector * scale).into(),
            rotation: (turn * own.rotation * turn.inverse()).into_inner().coords.into(),
        }
    };
    let mut placed = motion.clone();
    for joint in &mut placed.joints {
        joint.rest = moved(&joint.rest);
        joint.end = joint.end.map(|end| (turn * Vec3::from(end) * scale).into());
    }
    placed.frames.iter_mut().flatten().for_each(|t| *t = moved(t));
    placed
}

/// Z up, the person faces −Y: as Blender writes it.
pub fn z_up() -> Turn {
    Turn::from_axis_angle(&Vec3::x_axis(), 90f64.to_radians())
}

/// Every joint has axes of its own, with the bone along x, as Bandai-Namco's files: the rest pose is a heap of bones.
pub fn with_own_axes(motion: &RawMotion) -> RawMotion {
    let axes: Vec<Turn> = motion
        .joints
        .iter()
        .enumerate()
        .map(|(j, _)| {
            let child = motion.joints.iter().find(|joint| joint.parent == Some(j));
            let bone = child.map_or(Vec3::z(), |child| Vec3::from(child.rest.translation));
            Turn::rotation_between(&Vec3::x(), &bone).unwrap_or_else(|| Turn::from_axis_angle(&Vec3::y_axis(), 3.0))
        })
        .collect();
    let mut own = motion.clone();
    let above = |j: usize| motion.joints[j].parent.map_or_else(Turn::identity, |parent| axes[parent]);
    for j in 0..motion.joints.len() {
        let offset = above(j).inverse() * Vec3::from(motion.joints[j].rest.translation);
        own.joints[j].rest = RawTransform::translated(offset.into());
        for (frame, source) in own.frames.iter_mut().zip(&motion.frames) {
            let t = isometry(&source[j]);
            let rotation = above(j).inverse() * t.rotation * axes[j];
            frame[j] =
                raw(&Isometry3::from_parts(Translation3::from(above(j).inverse() * t.translation.vector), rotation));
        }
    }
    own
}

/// Limbs of two joints each, of which the second has half of the twist, and connectors before the legs.
pub fn with_twist_bones(motion: &RawMotion) -> RawMotion {
    let mut split = RawMotion { joints: Vec::new(), frames: vec![Vec::new(); motion.frames.len()], ..motion.clone() };
    let mut ends: Vec<usize> = Vec::new();
    for (j, joint) in motion.joints.iter().enumerate() {
        let parent = joint.parent.map(|parent| ends[parent]);
        let limb = Side::BOTH.iter().any(|&side| {
            [UpperArm(side), LowerArm(side), UpperLeg(side), LowerLeg(side)].iter().any(|h| h.name() == joint.name)
        });
        // The end of the limb's bone is the child's offset, half of which goes to the second joint.
        let half = motion
            .joints
            .iter()
            .find(|child| child.parent == Some(j))
            .map(|child| Vec3::from(child.rest.translation) * 0.5);
        let is_after_limb = joint.parent.is_some_and(|parent| {
            let name = &motion.joints[parent].name;
            Side::BOTH
                .iter()
                .any(|&s| [UpperArm(s), LowerArm(s), UpperLeg(s), LowerLeg(s)].iter().any(|h| h.name() == name))
        });
        let rest = Vec3::from(joint.rest.translation) * if is_after_limb { 0.5 } else { 1.0 };
        split.joints.push(RawJoint { parent, rest: RawTransform::translated(rest.into()), ..joint.clone() });
        for (frame, source) in split.frames.iter_mut().zip(&motion.frames) {
            let own = isometry(&source[j]);
            let translation = if joint.parent.is_some() { rest } else { own.translation.vector };
            let rotation = if limb { untwisted(&own.rotation) } else { own.rotation };
            frame.push(raw(&Isometry3::from_parts(Translation3::from(translation), rotation)));
        }
        if let (true, Some(half)) = (limb, half) {
            let above = split.joints.len() - 1;
            split.joints.push(RawJoint {
                name: format!("{}2", joint.name),
                parent: Some(above),
                rest: RawTransform::translated(half.into()),
                end: None,
            });
            for (frame, source) in split.frames.iter_mut().zip(&motion.frames) {
                let own = isometry(&source[j]).rotation;
                let rest_of = untwisted(&own).inverse() * own;
                frame.push(raw(&Isometry3::from_parts(Translation3::from(half), rest_of)));
            }
        }
        ends.push(split.joints.len() - 1);
    }
    split
}

/// A rotation without half of its twist about y, the direction of all limbs in the neutral pose.
fn untwisted(rotation: &Turn) -> Turn {
    let twist = 2.0 * rotation.j.atan2(rotation.w);
    rotation * Turn::from_axis_angle(&Vec3::y_axis(), -0.5 * twist)
}

/// Other names.
pub fn renamed(motion: &RawMotion, name: impl Fn(usize, &str) -> String) -> RawMotion {
    let mut renamed = motion.clone();
    for (j, joint) in renamed.joints.iter_mut().enumerate() {
        joint.name = name(j, &joint.name);
    }
    renamed
}
