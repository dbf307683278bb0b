//! A clip: a skeleton of any kind, and its motion.

use crate::formats::{RawMotion, RawTransform};
use crate::geometry::Vec3;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// Frames per second of a clip that states none: what most programs use.
const USUAL_FPS: f64 = 30.0;

/// Times between frames that a capture can have, in seconds: 1000 to 0.1 frames per second.
const FRAME_SECS: std::ops::RangeInclusive<f64> = 1e-3..=10.0;

/// A frame time this close to that of a whole number of frames per second, relative to it, is that time.
const ROUNDED_TIME: f64 = 2e-4;

/// A joint of a clip's skeleton.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ClipJoint {
    pub name: String,
    pub parent: Option<usize>,
    /// The end of the joint's bone in the joint's frame, where no other joint marks it.
    pub end: Option<Vec3>,
}

/// A motion of a skeleton of any kind, in the frame and unit of its file.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// What it is called: the file's stem.
    pub name: String,
    /// What the reader assumed, corrected or left out, one sentence each.
    pub notes: Vec<String>,
    pub(super) joints: Vec<ClipJoint>,
    /// `world_from_joint` in the rest pose.
    pub(super) rest: Vec<Isometry3<f64>>,
    /// Frame by frame `parent_from_joint`, F × J.
    frames: Vec<Vec<Isometry3<f64>>>,
    frame_secs: f64,
}

impl Clip {
    /// The clip of a motion file.
    pub fn new(name: &str, raw: RawMotion) -> Self {
        let joints: Vec<ClipJoint> = raw
            .joints
            .iter()
            .map(|joint| ClipJoint { name: joint.name.clone(), parent: joint.parent, end: joint.end.map(Vec3::from) })
            .collect();
        let rest = accumulated(&joints, &raw.joints.iter().map(|joint| isometry(&joint.rest)).collect::<Vec<_>>());
        let frames = raw.frames.iter().map(|frame| frame.iter().map(isometry).collect()).collect();
        let mut notes = raw.notes;
        // Files round the time: 0.041667 for 24 per second.
        let stated = raw.frame_secs.filter(|secs| FRAME_SECS.contains(secs)).map(|secs| {
            let whole = (1.0 / secs).round();
            if (secs * whole - 1.0).abs() < ROUNDED_TIME { 1.0 / whole } else { secs }
        });
        if let Some(secs) = raw.frame_secs.filter(|_| stated.is_none()) {
            notes.push(format!("the file states an impossible frame time of {secs:e} s"));
        }
        let frame_secs = stated.unwrap_or_else(|| {
            notes.push(format!("{USUAL_FPS} frames per second are assumed"));
            1.0 / USUAL_FPS
        });
        Self { name: name.into(), notes, joints, rest, frames, frame_secs }
    }

    /// The clip in a mirror, in the plane x = 0 of its frame.
    pub(super) fn mirrored(&self) -> Self {
        let mirror = |t: &Isometry3<f64>| {
            let (moved, q) = (t.translation.vector, t.rotation);
            let rotation = UnitQuaternion::new_unchecked(Quaternion::new(q.w, q.i, -q.j, -q.k));
            Isometry3::from_parts(Translation3::new(-moved.x, moved.y, moved.z), rotation)
        };
        let all = |transforms: &Vec<Isometry3<f64>>| transforms.iter().map(mirror).collect();
        let joint = |joint: &ClipJoint| ClipJoint {
            end: joint.end.map(|end| Vec3::new(-end.x, end.y, end.z)),
            ..joint.clone()
        };
        Self {
            joints: self.joints.iter().map(joint).collect(),
            rest: all(&self.rest),
            frames: self.frames.iter().map(all).collect(),
            ..self.clone()
        }
    }

    /// The number of frames.
    pub fn frame_count(&self) -> usize {
        self.frames.len()
    }

    /// Frames per second.
    pub fn fps(&self) -> f64 {
        1.0 / self.frame_secs
    }

    /// The number of joints.
    pub fn joint_count(&self) -> usize {
        self.joints.len()
    }

    /// `world_from_joint` of every joint in a frame.
    pub(super) fn world(&self, frame: usize) -> Vec<Isometry3<f64>> {
        accumulated(&self.joints, &self.frames[frame])
    }

    /// `world_from_joint` of every joint in a frame that need not be of this clip.
    ///
    /// **Shapes** `frame`: one transform per joint.
    pub(super) fn world_of(&self, frame: &[RawTransform]) -> Vec<Isometry3<f64>> {
        accumulated(&self.joints, &frame.iter().map(isometry).collect::<Vec<_>>())
    }

    /// `world_from_joint` of every joint at a time, between the frames by rotation along the shorter way.
    pub(super) fn world_at(&self, secs: f64) -> Vec<Isometry3<f64>> {
        let place = (secs / self.frame_secs).clamp(0.0, (self.frames.len() - 1) as f64);
        // A place within rounding of a frame is the frame.
        let (before, share) = match place.round() {
            whole if (whole - place).abs() < 1e-6 => (whole as usize, 0.0),
            _ => (place.floor() as usize, place.fract()),
        };
        if share == 0.0 {
            return self.world(before);
        }
        let between = |(a, b): (&Isometry3<f64>, &Isometry3<f64>)| {
            let rotation = a.rotation.try_slerp(&b.rotation, share, 1e-9).unwrap_or(a.rotation);
            Isometry3::from_parts(Translation3::from(a.translation.vector.lerp(&b.translation.vector, share)), rotation)
        };
        let local: Vec<_> = self.frames[before].iter().zip(&self.frames[before + 1]).map(between).collect();
        accumulated(&self.joints, &local)
    }

    /// The first frame with a number so large that sums and squares of such numbers are not finite or lose all digits.
    pub(super) fn first_frame_out_of_range(&self) -> Option<usize> {
        /// In the clip's unit; in nanometres this is a kilometre.
        const GREATEST: f64 = 1e12;
        let is_far = |t: &Isometry3<f64>| !t.translation.vector.iter().all(|x| x.abs() < GREATEST);
        if self.rest.iter().any(is_far) {
            return Some(0);
        }
        self.frames.iter().position(|frame| frame.iter().any(is_far))
    }

    /// Whether a joint ever turns relative to its parent, from a pose of the whole skeleton.
    pub(super) fn turns(&self, joint: usize, reference: &[Isometry3<f64>]) -> bool {
        /// In radians: 1°.
        const LEAST: f64 = 0.0175;
        let above = self.joints[joint].parent.map_or_else(UnitQuaternion::identity, |above| reference[above].rotation);
        let usual = above.inverse() * reference[joint].rotation;
        self.frames.iter().any(|frame| frame[joint].rotation.angle_to(&usual) > LEAST)
    }

    /// Whether `joint` is `ancestor` or below it.
    pub(super) fn is_below(&self, joint: usize, ancestor: usize) -> bool {
        let mut at = Some(joint);
        while let Some(j) = at {
            if j == ancestor {
                return true;
            }
            at = self.joints[j].parent;
        }
        false
    }
}

fn isometry(t: &RawTransform) -> Isometry3<f64> {
    let rotation = UnitQuaternion::new_normalize(Quaternion::from(t.rotation));
    Isometry3::from_parts(Translation3::from(Vec3::from(t.translation)), rotation)
}

fn accumulated(joints: &[ClipJoint], local: &[Isometry3<f64>]) -> Vec<Isometry3<f64>> {
    let mut world: Vec<Isometry3<f64>> = Vec::with_capacity(local.len());
    for (joint, own) in joints.iter().zip(local) {
        world.push(joint.parent.map_or(*own, |parent| world[parent] * own));
    }
    world
}
