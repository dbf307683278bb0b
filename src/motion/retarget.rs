//! Retargeting: the rotations of a clip's bones on a figure's skeleton, and the way of its hips.
//!
//! The bind pose is first turned to the clip's reference pose, limb by limb; from there each joint turns as the clip's
//! does, in world axes. So the segments of the arms and legs point exactly where the clip's do. The trunk, the hands and the
//! feet take over rotations alone: rigs place those joints differently inside the body. Fingers turn as the clip's if these
//! ever turn; others keep their bend.

use super::aligned::{about_vertical, aligned, bone_end, heading, midpoint, smallest_rotation};
use super::clip::Clip;
use super::error::MotionError;
use super::fingers::align_fingers;
use super::placement::{Placement, position};
use super::rig_map::{REQUIRED, RigMap};
use crate::body::HumanJoint::{
    self, Chest, Foot, Hand, Head, Hips, LowerArm, LowerLeg, Neck, Shoulder, Spine, Toes, UpperArm, UpperChest,
    UpperLeg,
};
use crate::body::Side::{self, Left, Right};
use crate::body::{JointId, Limb, Pose, Skeleton};
use crate::geometry::{Point, Vec3};
use nalgebra::{Isometry3, UnitQuaternion};

/// A clip that begins further than this from the origin, in metres, is moved to begin there.
const FAR_START: f64 = 0.5;
/// A clip that begins by looking further than this from +Z is turned to begin there, in radians: 45°.
const TURNED_START: f64 = std::f64::consts::FRAC_PI_4;
/// A person who moves faster than this, in metres per second, was moved by the program: the fastest sprint is 12.4.
const FASTEST: f64 = 15.0;
/// Moves shorter than this, in metres, are noise at high frame rates and no jump.
const SHORTEST_JUMP: f64 = 0.2;

/// What a retargeting found.
#[derive(Clone, Debug, Default)]
pub(super) struct Retargeted {
    /// One pose per sampled time.
    pub poses: Vec<Pose>,
    /// Frames at which the whole body jumped, and how far, in metres; the jumps are removed.
    pub jumps: Vec<(usize, f64)>,
}

/// **Shapes** `sources`, `to_reference`: one per joint of the figure.
pub(super) struct Retargeter<'a> {
    skeleton: &'a Skeleton,
    map: RigMap,
    placement: Placement,
    /// What turns each joint; `None` for a joint that the clip does not have.
    sources: Vec<Option<Source>>,
    /// The rotation from the bind pose to the clip's reference pose.
    to_reference: Vec<UnitQuaternion<f64>>,
    /// Metres per unit of the clip.
    scale: f64,
}

impl<'a> Retargeter<'a> {
    /// **Errors** for a skeleton without legs or arms.
    pub fn try_new(
        skeleton: &'a Skeleton,
        clip: &Clip,
        map: RigMap,
        placement: Placement,
    ) -> Result<Self, MotionError> {
        for side in Side::BOTH {
            for joint in REQUIRED.map(|joint| joint(side)) {
                if skeleton.find(joint).is_none() {
                    return Err(MotionError::FigureWithout { limb: joint.limb() });
                }
            }
        }
        let Some(leg) = leg_in_bind(skeleton) else { return Err(MotionError::FigureWithout { limb: Limb::Leg(Left) }) };
        let direction = |joint| {
            let at = |joint| position(&placement.reference, &map, joint);
            Some(placement.ours_from_reference * (at(bone_end(joint)?)? - at(joint)?))
        };
        let mut to_reference = aligned(skeleton, direction);
        let finger = |j: JointId| map.fingers.get(&skeleton.names[j.index()]).copied();
        let source = |j: JointId| match skeleton.human_joint(j) {
            Some(joint) => Source::of(joint, clip, &map),
            None => finger(j).map(Source::whole),
        };
        let sources = skeleton.ids().map(source).collect();
        align_fingers(skeleton, &mut to_reference, |joint| {
            Some(placement.ours_from_reference * placement.reference[finger(joint)?].translation.vector)
        });
        let scale = leg / placement.leg;
        Ok(Self { skeleton, map, placement, sources, to_reference, scale })
    }

    /// The poses at the given times of a clip with the skeleton that this was made for, with the hips as high above the floor as
    /// in the clip, up to a constant.
    pub fn poses(&self, clip: &Clip, times: &[f64]) -> Retargeted {
        let mut result = Retargeted::default();
        let worlds = times.iter().map(|&secs| clip.world_at(secs));
        let mut hips_before: Option<Point> = None;
        let mut shift = Vec3::zeros();
        let mut start: Option<Start> = None;
        for (frame, world) in worlds.enumerate() {
            let hips = self.hips_of(&world);
            let start = start.get_or_insert_with(|| self.start_at(&world, &hips));
            let step_secs = if frame == 0 { 0.0 } else { times[frame] - times[frame - 1] };
            if let Some(before) = hips_before {
                let step = hips - before;
                if step.norm() > SHORTEST_JUMP.max(FASTEST * step_secs) {
                    result.jumps.push((frame, step.norm()));
                    shift -= step;
                }
            }
            hips_before = Some(hips);
            result.poses.push(self.pose_at(&world, start, &hips, &shift));
        }
        result
    }

    /// How a clip is moved that begins with this frame.
    pub fn start_of(&self, world: &[Isometry3<f64>]) -> Start {
        self.start_at(world, &self.hips_of(world))
    }

    /// The pose of one frame of a clip that is moved by `start`.
    pub fn pose_from(&self, world: &[Isometry3<f64>], start: &Start) -> Pose {
        self.pose_at(world, start, &self.hips_of(world), &Vec3::zeros())
    }

    /// The pose of one frame, with the hips moved by `shift` besides.
    fn pose_at(&self, world: &[Isometry3<f64>], start: &Start, hips: &Point, shift: &Vec3) -> Pose {
        let hips = Point::from(start.turn * (hips - start.place)) + start.turn * shift + start.moved_to.coords;
        self.pose(world, &start.turn, &hips)
    }

    /// The middle of the hip joints, upright and in metres.
    fn hips_of(&self, world: &[Isometry3<f64>]) -> Point {
        let at = |side| position(world, &self.map, UpperLeg(side)).unwrap_or_else(Point::origin);
        Point::from(self.placement.ours_from_world * midpoint(&at(Left), &at(Right)).coords * self.scale)
    }

    /// How the clip is moved and turned so that it begins where the figure stands.
    fn start_at(&self, world: &[Isometry3<f64>], hips: &Point) -> Start {
        let here = self.hips_in_bind();
        let forward = self.map.start(Hips).map_or(0.0, |j| heading(&self.turned(world, j)));
        let turn = if forward.abs() > TURNED_START { about_vertical(-forward) } else { UnitQuaternion::identity() };
        let is_far = (hips.xz() - here.xz()).norm() > FAR_START;
        let place = Point::new(hips.x, 0.0, hips.z);
        let moved_to = if is_far { Point::new(here.x, 0.0, here.z) } else { place };
        Start { turn, place, moved_to }
    }

    fn hips_in_bind(&self) -> Point {
        let at = |side| {
            self.skeleton.find(UpperLeg(side)).map_or_else(Point::origin, |j| self.skeleton.joints_in_bind[j.index()])
        };
        midpoint(&at(Left), &at(Right))
    }

    /// How a joint of the clip has turned since the reference pose, in our axes.
    fn turned(&self, world: &[Isometry3<f64>], joint: usize) -> UnitQuaternion<f64> {
        let Placement { reference, ours_from_reference, ours_from_world, .. } = &self.placement;
        let reference = ours_from_reference * reference[joint].rotation;
        ours_from_world * world[joint].rotation * reference.inverse()
    }

    /// The pose of the figure for one frame of the clip.
    fn pose(&self, world: &[Isometry3<f64>], turn: &UnitQuaternion<f64>, hips: &Point) -> Pose {
        let skeleton = self.skeleton;
        let mut pose = Pose::bind(skeleton.len());
        let mut rotations: Vec<UnitQuaternion<f64>> = Vec::with_capacity(skeleton.len());
        for j in skeleton.ids() {
            let above = skeleton.parents[j.index()].map_or_else(UnitQuaternion::identity, |p| rotations[p.index()]);
            let own = self.sources[j.index()].map(|source| self.rotation(world, j, source));
            let rotation = own.map_or(above, |own| turn * own);
            pose.rotations[j.index()] = above.inverse() * rotation;
            rotations.push(rotation);
        }
        let root = skeleton.joints_in_bind[0];
        let from_root = rotations[0] * (self.hips_in_bind() - root);
        pose.translation = hips.coords - from_root - root.coords;
        pose
    }

    /// The rotation of a joint from the bind pose, in our axes.
    fn rotation(&self, world: &[Isometry3<f64>], joint: JointId, source: Source) -> UnitQuaternion<f64> {
        let to_reference = self.to_reference[joint.index()];
        let turned = self.turned(world, source.joint);
        let Some([start, end]) = source.segment else { return turned * to_reference };
        let at = |world: &[Isometry3<f64>], j: usize| world[j].translation.vector;
        let Placement { reference, ours_from_reference, ours_from_world, .. } = &self.placement;
        let carried = turned * (ours_from_reference * (at(reference, end) - at(reference, start)));
        let wanted = ours_from_world * (at(world, end) - at(world, start));
        smallest_rotation(&carried, &wanted) * turned * to_reference
    }
}

/// The joints of a clip that turn a human joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Source {
    /// Its rotation is taken over.
    joint: usize,
    /// The start and the end of a limb's segment, whose direction is taken over.
    segment: Option<[usize; 2]>,
}

impl Source {
    /// The rotation of one joint.
    fn whole(joint: usize) -> Self {
        Self { joint, segment: None }
    }

    /// `None` for a joint that the clip does not have.
    fn of(joint: HumanJoint, clip: &Clip, map: &RigMap) -> Option<Self> {
        // The joint above another one, if the chain from `start` contains it.
        let last = |below: usize, start| clip.joints[below].parent.filter(|&last| clip.is_below(last, start));
        match joint {
            Hips | Hand(_) | Head | Foot(_) | Toes(_) => map.start(joint).map(Self::whole),
            Spine | Chest | UpperChest | Neck => map.middle(joint).map(Self::whole),
            // The upper arm hangs on the last joint of the shoulder.
            Shoulder(side) => {
                let start = map.start(joint)?;
                Some(Self::whole(map.start(UpperArm(side)).and_then(|arm| last(arm, start)).unwrap_or(start)))
            }
            UpperArm(_) | LowerArm(_) | UpperLeg(_) | LowerLeg(_) => {
                let start = map.start(joint)?;
                let Some(end) = bone_end(joint).and_then(|end| map.start(end)) else {
                    return Some(Self::whole(start));
                };
                // A limb may have several joints; the last of them carries the end and has the whole twist.
                Some(Self { joint: last(end, start).unwrap_or(start), segment: Some([start, end]) })
            }
        }
    }
}

/// How a clip is moved so that it begins where the figure stands: about the vertical at `place`, which goes to `moved_to`.
pub(super) struct Start {
    turn: UnitQuaternion<f64>,
    place: Point,
    moved_to: Point,
}

/// Mean length of thigh and lower leg in the bind pose.
fn leg_in_bind(skeleton: &Skeleton) -> Option<f64> {
    let at = |joint| Some(skeleton.joints_in_bind[skeleton.find(joint)?.index()]);
    let leg = |side: Side| {
        let (hip, knee, foot) = (at(UpperLeg(side))?, at(LowerLeg(side))?, at(Foot(side))?);
        Some((knee - hip).norm() + (foot - knee).norm())
    };
    Some(0.5 * (leg(Left)? + leg(Right)?)).filter(|leg| *leg > 1e-6)
}
