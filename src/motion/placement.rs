//! The frame, the size and the reference pose of a clip's skeleton.

use super::clip::Clip;
use super::error::MotionError;
use super::rig_map::RigMap;
use crate::body::HumanJoint::{self, Foot, Hand, Head, LowerArm, LowerLeg, Neck, UpperArm, UpperLeg};
use crate::body::Side::{self, Left, Right};
use crate::geometry::{Point, Vec3};
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion};

/// A direction this close to a coordinate axis is the axis: people lean and turn out their feet, files do not.
const SNAP_DEG: f64 = 30.0;
/// How far legs may be from straight down, knees from straight, in a pose that stands: A- and T-poses of all rigs do.
const STANDING_LEG_DEG: f64 = 40.0;
/// How far elbows may be bent in a pose that stands.
const STANDING_ELBOW_DEG: f64 = 60.0;
/// Frames that are examined for an up axis and a reference pose; more tell nothing new.
const EXAMINED_FRAMES: usize = 60;

/// How a clip's coordinates become ours.
#[derive(Clone, Debug)]
pub(super) struct Placement {
    /// `world_from_joint` in the reference pose, in the clip's own frame.
    pub reference: Vec<Isometry3<f64>>,
    /// Turns the reference pose upright, facing +Z.
    pub ours_from_reference: UnitQuaternion<f64>,
    /// Turns the clip's frames upright.
    pub ours_from_world: UnitQuaternion<f64>,
    /// Length of a leg, thigh and lower leg, in the clip's unit.
    pub leg: f64,
    /// The frame that serves as reference pose; `None` for the rest pose.
    pub reference_frame: Option<usize>,
    /// The clip's unit and up axis, in words.
    pub assumed: String,
}

impl Placement {
    /// **Errors** for a skeleton without legs, or with positions that are not finite.
    pub fn of(clip: &Clip, map: &RigMap) -> Result<Self, MotionError> {
        let count = clip.frame_count();
        let examined: Vec<usize> =
            (0..count.min(EXAMINED_FRAMES)).map(|k| k * (count - 1) / (count.clamp(2, EXAMINED_FRAMES) - 1)).collect();
        let frames: Vec<Vec<Isometry3<f64>>> = examined.iter().map(|&f| clip.world(f)).collect();
        if let Some(frame) = clip.first_frame_out_of_range() {
            return Err(MotionError::NotFinite { frame });
        }
        let leg = leg_length(&frames, &examined, map)?;

        let rest = Stance::of(&clip.rest, map);
        // The rest pose may be anything: all bones along x, or all in one place.
        let best = (0..frames.len()).min_by(|&a, &b| {
            let deviation = |k: usize| Stance::of(&frames[k], map).map_or(f64::INFINITY, |s| s.deviation);
            deviation(a).total_cmp(&deviation(b))
        });
        let of_best = best.and_then(|k| Stance::of(&frames[k], map));
        let (reference, stance, reference_frame) = match (rest, of_best, best) {
            (Some(rest), of_best, _)
                if rest.deviation <= 1.0 || of_best.as_ref().is_none_or(|b| b.deviation >= rest.deviation) =>
            {
                (clip.rest.clone(), rest, None)
            }
            (_, Some(stance), Some(k)) => (frames[k].clone(), stance, Some(examined[k])),
            _ => return Err(MotionError::NoLegs { found: 0.0, frame: 0 }),
        };
        let ours_from_reference = stance.upright();
        let ours_from_world = match reference_frame.is_none().then(|| up_of_frames(&frames, map, &stance)).flatten() {
            Some(up) => upright(&up, &facing_at(&frames[0], map)),
            None => ours_from_reference,
        };
        let up = ours_from_world.inverse() * Vec3::y();
        let assumed = format!("{}, {} up", unit_of(leg), axis_name(&up));
        Ok(Self { reference, ours_from_reference, ours_from_world, leg, reference_frame, assumed })
    }
}

/// Median over frames of the mean length of the legs.
fn leg_length(frames: &[Vec<Isometry3<f64>>], examined: &[usize], map: &RigMap) -> Result<f64, MotionError> {
    let mut lengths: Vec<f64> = frames
        .iter()
        .map(|world| {
            let at = |joint| position(world, map, joint).unwrap_or_else(Point::origin);
            let leg = |side: Side| {
                (at(LowerLeg(side)) - at(UpperLeg(side))).norm() + (at(Foot(side)) - at(LowerLeg(side))).norm()
            };
            0.5 * (leg(Left) + leg(Right))
        })
        .collect();
    lengths.sort_by(f64::total_cmp);
    let leg = lengths[lengths.len() / 2];
    if leg.is_finite() && leg > 1e-6 { Ok(leg) } else { Err(MotionError::NoLegs { found: leg, frame: examined[0] }) }
}

/// Where a human joint is.
pub(super) fn position(world: &[Isometry3<f64>], map: &RigMap, joint: HumanJoint) -> Option<Point> {
    map.start(joint).map(|j| Point::from(world[j].translation.vector))
}

/// The directions of a pose that may stand.
#[derive(Clone, Debug)]
struct Stance {
    /// From the feet to the head.
    up: Vec3,
    forward: Vec3,
    /// The greatest deviation from standing, relative to what standing allows.
    deviation: f64,
}

impl Stance {
    /// `None` where bones have no length.
    fn of(world: &[Isometry3<f64>], map: &RigMap) -> Option<Self> {
        let at = |joint| position(world, map, joint);
        let both = |joint: fn(Side) -> HumanJoint| Some(nalgebra::center(&at(joint(Left))?, &at(joint(Right))?));
        let (hips, shoulders, feet) = (both(UpperLeg)?, both(UpperArm)?, both(Foot)?);
        let top = at(Head).or(at(Neck)).unwrap_or(shoulders);
        let up = (top - feet).try_normalize(1e-9)?;
        let trunk = (shoulders - hips).try_normalize(1e-9)?;
        let left = left_of(world, map)?;
        let forward = left.cross(&up).try_normalize(1e-9)?;
        let angle = |a: Vec3, b: Vec3| {
            Some(a.try_normalize(1e-9)?.dot(&b.try_normalize(1e-9)?).clamp(-1.0, 1.0).acos().to_degrees())
        };
        let mut deviation: f64 = angle(trunk, up)? / STANDING_LEG_DEG;
        for side in Side::BOTH {
            let (hip, knee, foot) = (at(UpperLeg(side))?, at(LowerLeg(side))?, at(Foot(side))?);
            let (shoulder, elbow) = (at(UpperArm(side))?, at(LowerArm(side))?);
            deviation = deviation.max(angle(foot - hip, -trunk)? / STANDING_LEG_DEG);
            deviation = deviation.max(angle(knee - hip, foot - knee)? / STANDING_LEG_DEG);
            if let Some(hand) = at(Hand(side)) {
                deviation = deviation.max(angle(elbow - shoulder, hand - elbow)? / STANDING_ELBOW_DEG);
                // Arms hang or are held sideways; they are not raised above 45°, nor across the chest.
                let arm = (hand - shoulder).try_normalize(1e-9)?;
                let raised = arm.dot(&up).max(-arm.dot(&(left * side.sign()))).max(arm.dot(&forward).abs());
                deviation = deviation.max(raised / 0.75);
            }
        }
        Some(Self { up, forward, deviation })
    }

    fn upright(&self) -> UnitQuaternion<f64> {
        upright(&self.up, &self.forward)
    }
}

/// From the right hip to the left one, with the shoulders.
fn left_of(world: &[Isometry3<f64>], map: &RigMap) -> Option<Vec3> {
    let across =
        |joint: fn(Side) -> HumanJoint| Some(position(world, map, joint(Left))? - position(world, map, joint(Right))?);
    let (hips, shoulders) = (across(UpperLeg)?, across(UpperArm)?);
    let shoulders = shoulders.try_normalize(1e-9).unwrap_or_default();
    (hips.try_normalize(1e-9)? + shoulders).try_normalize(1e-9)
}

/// The direction in which a person in this pose looks; zero if it is unknown.
fn facing_at(world: &[Isometry3<f64>], map: &RigMap) -> Vec3 {
    let top = position(world, map, UpperArm(Left)).zip(position(world, map, UpperArm(Right)));
    let hips = position(world, map, UpperLeg(Left)).zip(position(world, map, UpperLeg(Right)));
    match (left_of(world, map), top, hips) {
        (Some(left), Some(top), Some(hips)) => {
            left.cross(&(nalgebra::center(&top.0, &top.1) - nalgebra::center(&hips.0, &hips.1)))
        }
        _ => Vec3::zeros(),
    }
}

/// The up axis of the frames where they contradict that of the reference pose: where people stand along another axis in most
/// frames. Some programs turn the skeleton by its root; a person who lies or does a handstand is no reason.
fn up_of_frames(frames: &[Vec<Isometry3<f64>>], map: &RigMap, reference: &Stance) -> Option<Vec3> {
    /// Cosine above which a person stands along an axis.
    const STANDS: f64 = 0.8;
    /// Frames below which a lying person cannot be told from another axis.
    const FEWEST: usize = 10;
    let stances: Vec<Stance> = frames.iter().filter_map(|world| Stance::of(world, map)).collect();
    let standing = |axis: &Vec3| stances.iter().filter(|s| s.deviation <= 1.5 && s.up.dot(axis) > STANDS).count();
    let axes = [Vec3::x(), Vec3::y(), Vec3::z()].into_iter().flat_map(|axis| [axis, -axis]);
    let best = axes.max_by_key(|axis| standing(axis))?;
    let is_clear = standing(&best) * 5 >= frames.len() * 4 && standing(&snapped(&reference.up)) * 5 < frames.len();
    (frames.len() >= FEWEST && is_clear).then_some(best)
}

/// The nearest coordinate axis, if it is near.
fn snapped(v: &Vec3) -> Vec3 {
    let k = v.iamax();
    let axis = Vec3::ith(k, v[k].signum());
    if v.dot(&axis) >= SNAP_DEG.to_radians().cos() * v.norm() { axis } else { *v }
}

/// The rotation that turns `up` to +Y and `forward` to +Z.
fn upright(up: &Vec3, forward: &Vec3) -> UnitQuaternion<f64> {
    let up = snapped(up);
    let level = forward - up * (forward.dot(&up) / up.norm_squared());
    let forward = snapped(
        &level.try_normalize(1e-9).unwrap_or_else(|| super::aligned::smallest_rotation(&Vec3::y(), &up) * Vec3::z()),
    );
    let up = up.normalize();
    let left = up.cross(&forward).normalize();
    let forward = left.cross(&up);
    let rows = Matrix3::from_rows(&[left.transpose(), up.transpose(), forward.transpose()]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows))
}

/// The unit in which a leg of this length is that of a person.
fn unit_of(leg: f64) -> &'static str {
    /// Thigh and shank of an adult: 0.245 + 0.246 of 1.7 m.
    const LEG: f64 = 0.83;
    let units = [
        ("metres", 1.0),
        ("decimetres", 0.1),
        ("centimetres", 0.01),
        ("millimetres", 1e-3),
        ("inches", 0.0254),
        ("feet", 0.3048),
    ];
    let off = |unit: f64| (leg * unit / LEG).ln().abs();
    let best = units.into_iter().min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
    match best {
        // A child's leg has half the length.
        Some((name, unit)) if off(unit) < 0.7 => name,
        _ => "unknown unit",
    }
}

fn axis_name(up: &Vec3) -> &'static str {
    let k = up.iamax();
    match (k, up[k] > 0.0, up[k].abs() > 0.99) {
        (_, _, false) => "a slanted axis",
        (0, true, _) => "X",
        (0, false, _) => "−X",
        (1, true, _) => "Y",
        (1, false, _) => "−Y",
        (_, true, _) => "Z",
        (_, false, _) => "−Z",
    }
}
