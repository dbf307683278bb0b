//! Deformed skeletons: a sleeve or leg along the person's bones, a torso along the spine.
//!
//! **Source** Shi 2020, §5.3, Eqs. 8–11 and 13–15, corrected:
//! - Eq. 10 has no solution where a sleeve ends before the first bone does. All its nodes are on that bone then.
//! - Eq. 14 gives two rotations that meet at the elbow, which makes a kink. The corner is rounded by an arc that touches both
//!   bones about a radius of the sleeve from the elbow, and rotations blend along it; arc length is kept, as in Eq. 11, and before
//!   and after the arc the nodes are on the bones.
//! - A rotation from one vector to another leaves the twist open, and Q_i of neighbours may differ in it. Twist is transported:
//!   Q_{i+1} adds to Q_i only what turns the directions.
//! - Eq. 15's transformation moves node i to l'_{i+1} as printed; it moves it to l'_i here.
//! - For the torso (§7.4) see [`Person`].

use super::person::Person;
use super::skeleton::{CurveSkeleton, arc_lengths};
use crate::geometry::{Point, Vec3};
use nalgebra::{Unit, UnitQuaternion};

/// The arc at an elbow touches both bones this many radii of the limb from the corner: bent by 90°, cloth inside of the elbow keeps a
/// quarter of its length.
const ROUNDED_PER_RADIUS: f64 = 1.3;
/// It takes at most this share of either bone.
const ROUNDED_PER_BONE: f64 = 0.45;
/// Bones with a smaller angle between them, in radians, are straight.
const STRAIGHT: f64 = 1e-6;

/// A skeleton before and after its deformation.
#[derive(Clone, Debug, PartialEq)]
pub struct BentSkeleton {
    /// L: nodes of the oriented garment, in metres.
    pub from: Vec<Point>,
    /// f_seg from the first node to each, in metres.
    pub arcs: Vec<f64>,
    /// L': where the nodes go.
    pub to: Vec<Point>,
    /// Q_i: how the cloth at each node turns.
    pub turns: Vec<UnitQuaternion<f64>>,
    /// The bones that it follows, after Eq. 9; empty for a torso.
    pub bones: Vec<Point>,
}

impl BentSkeleton {
    /// Where a point goes that belongs to the skeleton at an arc length, and how it turns. Beyond its ends the skeleton is rigid.
    pub fn carry(&self, p: &Point, arc: f64) -> (Point, UnitQuaternion<f64>) {
        let last = self.arcs.len().saturating_sub(1);
        let k = self.arcs.partition_point(|a| *a <= arc).clamp(1, last.max(1)) - 1;
        let (Some(&from), Some(&to), Some(&turn)) = (self.from.get(k), self.to.get(k), self.turns.get(k)) else {
            return (*p, UnitQuaternion::identity());
        };
        if k + 1 > last {
            return (to + turn * (p - from), turn);
        }
        let share = ((arc - self.arcs[k]) / (self.arcs[k + 1] - self.arcs[k]).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let turn = turn.try_slerp(&self.turns[k + 1], share, 1e-9).unwrap_or(turn);
        let (from, to) = (from + (self.from[k + 1] - from) * share, to + (self.to[k + 1] - to) * share);
        (to + turn * (p - from), turn)
    }

    /// The arc length of the point of the skeleton nearest to a point, among the segments within two of a node. Beyond the ends the
    /// skeleton goes straight on.
    pub fn arc_near(&self, p: &Point, node: usize) -> f64 {
        let last = self.from.len().saturating_sub(2);
        let (mut best, mut least) = (0.0, f64::INFINITY);
        for k in node.saturating_sub(2)..=(node + 1).min(last) {
            let (Some(a), Some(b)) = (self.from.get(k), self.from.get(k + 1)) else { continue };
            let along = b - a;
            let share = (p - a).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE);
            let low = if k == 0 { f64::NEG_INFINITY } else { 0.0 };
            let high = if k == last { f64::INFINITY } else { 1.0 };
            let share = share.clamp(low, high);
            let far = (p - (a + along * share)).norm();
            if far < least {
                (best, least) = (self.arcs[k] + share * along.norm(), far);
            }
        }
        best
    }
}

/// Two bones with a rounded corner, by arc length.
#[derive(Clone, Copy, Debug)]
struct RoundedBones {
    start: Point,
    first: Unit<Vec3>,
    /// Arc length at which the arc begins, and its length.
    arc: [f64; 2],
    axis: Option<Unit<Vec3>>,
    angle: f64,
}

impl RoundedBones {
    fn of([a, b, c]: [Point; 3], radius: f64) -> Option<Self> {
        let (first, second) = (Unit::try_new(b - a, 1e-9)?, Unit::try_new(c - b, 1e-9)?);
        let (upper, lower) = ((b - a).norm(), (c - b).norm());
        let tangent = (ROUNDED_PER_RADIUS * radius).min(ROUNDED_PER_BONE * upper).min(ROUNDED_PER_BONE * lower);
        let angle = first.angle(&second);
        let axis = Unit::try_new(first.cross(&second), 1e-9).filter(|_| angle > STRAIGHT);
        // An arc that touches both bones at that distance from the corner.
        let length = if axis.is_some() { tangent * angle / (0.5 * angle).tan().max(1e-9) } else { 0.0 };
        Some(Self { start: a, first, arc: [upper - tangent, length], axis, angle })
    }

    /// The point at an arc length, and the direction there.
    fn at(&self, s: f64) -> (Point, Vec3) {
        let first = self.first.into_inner();
        let (Some(axis), [begin, length]) = (self.axis, self.arc) else { return (self.start + first * s, first) };
        if s <= begin {
            return (self.start + first * s, first);
        }
        let inward = axis.cross(&first);
        let radius = length / self.angle;
        let turned = (self.angle * (s - begin) / length.max(f64::MIN_POSITIVE)).min(self.angle);
        let on_arc = self.start + first * (begin + radius * turned.sin()) + inward * (radius * (1.0 - turned.cos()));
        let direction = first * turned.cos() + inward * turned.sin();
        (on_arc + direction * (s - begin - length).max(0.0), direction)
    }
}

/// A sleeve's or leg's skeleton along an arm's or leg's bones. `base` is where its first node goes, and how the torso
/// turns there.
///
/// **Frame** `skeleton` and the result in the oriented garment's place; bones keep their directions only (Eq. 9).
pub fn bent_limb(
    skeleton: &CurveSkeleton,
    bones: [Point; 3],
    base: (Point, UnitQuaternion<f64>),
) -> Option<BentSkeleton> {
    let from = skeleton.nodes.clone();
    let arcs = skeleton.arc_lengths();
    let bones = bones.map(|a| a + (base.0 - bones[0]));
    let elbow = arcs.partition_point(|s| *s < (bones[1] - bones[0]).norm()).min(from.len().checked_sub(1)?);
    let target = RoundedBones::of(bones, skeleton.radii.get(elbow).copied().unwrap_or(0.0))?;
    let before = directions(&from);
    let (to, after): (Vec<Point>, Vec<Vec3>) = arcs.iter().map(|&s| target.at(s)).unzip();
    let mut turn = between(&(base.1 * before.first()?), after.first()?) * base.1;
    let mut turns = vec![turn];
    for k in 1..from.len() {
        turn = between(&after[k - 1], &after[k]) * turn * between(&before[k - 1], &before[k]).inverse();
        turns.push(turn);
    }
    Some(BentSkeleton { from, arcs, to, turns, bones: bones.to_vec() })
}

/// n_i of Eq. 13, of length 1.
fn directions(nodes: &[Point]) -> Vec<Vec3> {
    let last = nodes.len().saturating_sub(1);
    let at = |k: usize| (nodes[(k + 1).min(last)] - nodes[k.saturating_sub(1)]).try_normalize(1e-12);
    (0..nodes.len()).map(|k| at(k).unwrap_or_else(Vec3::y)).collect()
}

/// The smallest rotation between unit vectors; for opposite ones by half a turn about any axis across.
fn between(a: &Vec3, b: &Vec3) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(a, b).unwrap_or_else(|| {
        let across = Unit::new_normalize(a.cross(&Vec3::ith(a.iamin(), 1.0)));
        UnitQuaternion::from_axis_angle(&across, std::f64::consts::PI)
    })
}

/// A torso's skeleton that turns as the body does at its heights, from its upper end down.
///
/// `height` gives the height in the person's bind pose of a point of the oriented garment; `turn` the turn of the cloth there.
pub fn bent_torso(
    nodes: &[Point],
    person: &Person,
    height: &dyn Fn(&Point) -> f64,
    turn: &dyn Fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>,
) -> BentSkeleton {
    let turns: Vec<UnitQuaternion<f64>> = nodes.iter().map(|p| turn(person.turn_at(height(p)))).collect();
    let mut to: Vec<Point> = nodes.iter().take(1).copied().collect();
    for k in 1..nodes.len() {
        let middle = turns[k - 1].try_slerp(&turns[k], 0.5, 1e-9).unwrap_or(turns[k]);
        to.push(to[k - 1] + middle * (nodes[k] - nodes[k - 1]));
    }
    BentSkeleton { from: nodes.to_vec(), arcs: arc_lengths(nodes), to, turns, bones: Vec::new() }
}
