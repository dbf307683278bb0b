//! Clips of a left-handed frame under right-handed names: the left hand is where the right one should be.

use super::clip::Clip;
use super::placement::{Placement, position};
use super::rig_map::RigMap;
use crate::body::HumanJoint;
use crate::body::HumanJoint::{Foot, LowerArm, LowerLeg, Toes, UpperArm, UpperLeg};
use crate::body::Side::{self, Left, Right};
use crate::geometry::{Point, Vec3};
use nalgebra::Isometry3;

/// Frames that are examined; more tell nothing new.
const EXAMINED_FRAMES: usize = 60;
/// A knee that is off the line from hip to ankle by less than this, relative to the leg, does not tell where it bends.
const LEAST_BEND: f64 = 0.03;
/// Cosine below which toes point backwards.
const TOES_BACK: f64 = -0.5;
/// Mean cosine below which knees bend backwards, between those of a person, near 0.9, and the opposite.
const KNEES_BACK: f64 = -0.4;

/// Whether the clip is the mirror image of a person: by the names of its sides it looks one way, by its knees and toes the other.
pub(super) fn is_mirrored(clip: &Clip, map: &RigMap, placement: &Placement) -> bool {
    let count = clip.frame_count();
    let frames: Vec<_> =
        (0..count.min(EXAMINED_FRAMES)).map(|k| clip.world(k * count / count.min(EXAMINED_FRAMES))).collect();
    let bends = |upper: fn(Side) -> HumanJoint, lower: fn(Side) -> HumanJoint, end: fn(Side) -> HumanJoint| {
        let of = |world: &Vec<Isometry3<f64>>| {
            let forward = forward(world, map)?;
            let bends =
                Side::BOTH.into_iter().filter_map(|side| bend(world, map, [upper(side), lower(side), end(side)]));
            Some(bends.map(|bend| (bend.norm(), bend.dot(&forward))).collect::<Vec<_>>())
        };
        let (size, along) =
            frames.iter().filter_map(of).flatten().fold((0.0, 0.0), |(s, a), (norm, dot)| (s + norm, a + dot));
        (size > 0.0).then(|| along / size)
    };
    let knees = bends(UpperLeg, LowerLeg, Foot);
    let elbows = bends(UpperArm, LowerArm, HumanJoint::Hand);
    match (toes(placement, map), knees) {
        (Some(toes), Some(knees)) => toes < TOES_BACK && knees < KNEES_BACK,
        // Legs that never bend: the elbows, which bend the other way, must agree.
        (Some(toes), None) => toes < TOES_BACK && elbows.is_none_or(|elbows| elbows > 0.0),
        (None, Some(knees)) => knees < KNEES_BACK && elbows.is_some_and(|elbows| elbows > 0.3),
        (None, None) => false,
    }
}

/// Where a person looks by the names of its sides; `None` where that is not defined.
fn forward(world: &[Isometry3<f64>], map: &RigMap) -> Option<Vec3> {
    let at = |joint| position(world, map, joint);
    let across = at(UpperLeg(Left))? - at(UpperLeg(Right))?;
    let up = nalgebra::center(&at(UpperArm(Left))?, &at(UpperArm(Right))?)
        - nalgebra::center(&at(UpperLeg(Left))?, &at(UpperLeg(Right))?);
    across.cross(&up).try_normalize(1e-12)
}

/// How far a knee or elbow is off the line between the ends of its limb, as a share of the limb; `None` if hardly.
fn bend(world: &[Isometry3<f64>], map: &RigMap, [upper, lower, end]: [HumanJoint; 3]) -> Option<Vec3> {
    let at = |joint| position(world, map, joint);
    let (from, hinge, to): (Point, Point, Point) = (at(upper)?, at(lower)?, at(end)?);
    let length = (hinge - from).norm() + (to - hinge).norm();
    let along = (to - from).try_normalize(1e-12)?;
    let off = hinge - from - along * along.dot(&(hinge - from));
    (off.norm() > LEAST_BEND * length).then(|| off / length)
}

/// The cosine between where the toes of the reference pose point and where the person looks by the names of its sides.
fn toes(placement: &Placement, map: &RigMap) -> Option<f64> {
    let at = |joint| position(&placement.reference, map, joint);
    let feet = Side::BOTH.into_iter().filter_map(|side| Some(at(Toes(side))? - at(Foot(side))?));
    let sum = placement.ours_from_reference * feet.sum::<Vec3>();
    Vec3::new(sum.x, 0.0, sum.z).try_normalize(1e-6 * placement.leg).map(|toes| toes.z)
}
