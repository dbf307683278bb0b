//! Where a garment lies on a figure: the pose that its limbs show, and the move that brings it around the body.
//!
//! **Source** Shi 2020, §§5.2 to 6.1. The paper turns the garment's limbs into the figure's pose; we turn the figure's limbs into
//! the garment's, which bends no cloth. Nothing is scaled (Eqs. 16 and 17): a garment of another size must look like one.

use super::error::TryOnError;
use super::limbs::{Limb, point_along};
use super::recognize::{Openings, recognize};
use super::rims::{Rim, rims_of};
use crate::body::{Figure, HumanJoint, JointId, Pose, Side, trunk_girths};
use crate::geometry::{Adjacency, Point, SurfaceIndex, TriMesh, Vec3};
use nalgebra::UnitQuaternion;

/// The longest limb, in metres: from the hip to the floor.
const LONGEST_LIMB: f64 = 1.1;
/// Vertices that a placing is judged by.
const JUDGED: usize = 1200;
/// The farthest that the search moves a garment from where its limbs put it, in metres, and one from where its waist fits: a skirt
/// that is too small must not slip down to the thighs.
const SEARCHED: f64 = 0.16;
const SEARCHED_AT_WAIST: f64 = 0.04;
/// Cloth this far from the skin costs as much as a penetration of a tenth of it: wide garments hang off the body.
const GAP_COUNTS: f64 = 0.1;
/// The other heading must fit better by this factor: openings are a surer sign than a chest.
const CLEARLY_BETTER: f64 = 0.6;

/// A joint of either side.
type OfSide = fn(Side) -> HumanJoint;

/// How a figure stands in a garment.
#[derive(Clone, Debug)]
pub struct Placed {
    /// The figure's pose, in the garment's frame: the garment stays where it is, the figure is moved.
    pub pose: Pose,
    /// The rim from which a garment hangs that begins at the waist.
    pub band: Option<Rim>,
    /// What the search minimised: depth, and a share of the gap, in metres.
    cost: f64,
}

/// Skeletons of a garment's limbs, the left first.
pub(super) fn limbs_of(garment: &TriMesh, openings: &Openings) -> Vec<Limb> {
    let adjacency = Adjacency::prepare(garment);
    openings
        .pair()
        .iter()
        .flat_map(|pair| pair.iter())
        .map(|rim| Limb::of(garment, &adjacency, rim, LONGEST_LIMB))
        .collect()
}

/// Poses a figure inside a garment that is upright and in metres.
pub fn place(garment: &TriMesh, figure: &Figure) -> Result<Placed, TryOnError> {
    let openings = recognize(garment, &rims_of(garment), Some(1.0))?.openings.in_order();
    Ok(placed(garment, &openings, figure))
}

fn placed(garment: &TriMesh, openings: &Openings, figure: &Figure) -> Placed {
    let limbs = limbs_of(garment, openings);
    let arms: [OfSide; 3] = [HumanJoint::UpperArm, HumanJoint::LowerArm, HumanJoint::Hand];
    let legs: [OfSide; 3] = [HumanJoint::UpperLeg, HumanJoint::LowerLeg, HumanJoint::Foot];
    let chain: Option<[OfSide; 3]> = match openings {
        Openings::Top { .. } | Openings::Open { .. } => Some(arms),
        Openings::Legs { .. } => Some(legs),
        Openings::Tube { .. } => None,
    };
    let mut pose = match chain {
        Some(chain) => pose_by(figure, &limbs, chain),
        None => Pose::bind(figure.skeleton.len()),
    };
    let mut starts = Vec::new();
    if let Some([upper, ..]) = chain {
        starts.push(shift_of_pair(figure, &pose, &limbs, upper));
    }
    if let Openings::Tube { waist, .. } = openings {
        starts.push(where_it_fits(figure, waist.length) - waist.center);
    }
    // A neckline is another sign of where a top belongs; sleeves that are lined or folded hide where they begin.
    if let Openings::Top { neck, .. } = openings {
        let joints = figure.skeleton.joints_in_world(&pose);
        starts.extend(figure.skeleton.find(HumanJoint::Neck).map(|j| joints[j.index()] - neck.center));
    }
    let body = SurfaceIndex::prepare(&figure.body().posed(&figure.skeleton, &pose));
    let searched = if chain.is_some() { SEARCHED } else { SEARCHED_AT_WAIST };
    let settled =
        starts.into_iter().map(|start| settled(garment, &body, start, searched)).min_by(|a, b| a.1.total_cmp(&b.1));
    let (shift, cost) = settled.unwrap_or_else(|| (Vec3::zeros(), f64::INFINITY));
    pose.translation -= shift;
    if let Some(chain) = chain {
        // Where the joints are by now says more than the directions of short sleeves.
        pose = aimed(figure, &pose, &limbs, chain);
    }
    Placed { pose, band: openings.band().cloned(), cost }
}

/// Whether a garment that is upright looks backwards: whether an average body fits it clearly better that way. And the move that
/// brings it onto that body, after half a turn if so.
pub(super) fn on_average(garment: &TriMesh, openings: &Openings, average: &Figure) -> (bool, Vec3) {
    let turned = garment.with_points(garment.points().iter().map(|p| Point::new(-p.x, p.y, -p.z)).collect::<Vec<_>>());
    let front = placed(garment, openings, average);
    let back = placed(&turned, &openings.turned_round(), average);
    let is_backwards = back.cost < CLEARLY_BETTER * front.cost;
    (is_backwards, -if is_backwards { back } else { front }.pose.translation)
}

/// The joints of a limb from the trunk on.
struct Bones {
    upper: JointId,
    lower: JointId,
    /// From joint to joint in the bind pose.
    bones: [Vec3; 2],
}

impl Bones {
    /// `None` for a skeleton without one of the joints.
    fn of(figure: &Figure, side: Side, chain: [OfSide; 3]) -> Option<Self> {
        let skeleton = &figure.skeleton;
        let [upper, lower, end] = chain.map(|joint| skeleton.find(joint(side)));
        let (upper, lower, end) = (upper?, lower?, end?);
        let [a, b, c] = [upper, lower, end].map(|j| skeleton.joints_in_bind[j.index()]);
        Some(Self { upper, lower, bones: [b - a, c - b] })
    }

    /// Turns both bones into directions.
    fn point(&self, pose: &mut Pose, [first, second]: [Vec3; 2]) {
        let turn = UnitQuaternion::rotation_between(&self.bones[0], &first).unwrap_or_default();
        let bent = UnitQuaternion::rotation_between(&(turn * self.bones[1]), &second).unwrap_or_default();
        pose.rotations[self.upper.index()] = turn;
        pose.rotations[self.lower.index()] = turn.inverse() * bent * turn;
    }
}

/// The pose whose upper and lower limbs point as the garment's do.
fn pose_by(figure: &Figure, limbs: &[Limb], chain: [OfSide; 3]) -> Pose {
    let mut pose = Pose::bind(figure.skeleton.len());
    for (side, limb) in Side::BOTH.into_iter().zip(limbs) {
        let (Some(bones), Some(whole)) = (Bones::of(figure, side, chain), limb.direction()) else { continue };
        // The limb begins at the joint, about a radius inside its first cross-section; a short one goes straight on.
        let radius = limb.girths.first().map_or(0.0, |girth| girth / std::f64::consts::TAU);
        let elbow = bones.bones[0].norm() - radius;
        let reaches = limb.length() > elbow + 0.08;
        let direction = |from: f64, to: f64| (limb.at(to) - limb.at(from)).try_normalize(1e-9).unwrap_or(whole);
        match reaches {
            true => bones.point(&mut pose, [direction(0.0, elbow), direction(elbow, limb.length())]),
            false => {
                pose.rotations[bones.upper.index()] =
                    UnitQuaternion::rotation_between(&bones.bones[0], &whole).unwrap_or_default()
            }
        }
    }
    pose
}

/// The pose whose limbs run through those of the garment: along their centres and out of their rims.
fn aimed(figure: &Figure, pose: &Pose, limbs: &[Limb], chain: [OfSide; 3]) -> Pose {
    let joints = figure.skeleton.joints_in_world(pose);
    let mut aimed = pose.clone();
    for (side, limb) in Side::BOTH.into_iter().zip(limbs) {
        let (Some(bones), 2..) = (Bones::of(figure, side, chain), limb.nodes.len()) else { continue };
        let begin = joints[bones.upper.index()];
        let way: Vec<Point> = std::iter::once(begin).chain(limb.nodes.iter().copied()).collect();
        let [upper, lower] = bones.bones.map(|bone| bone.norm());
        let (elbow, wrist) = (point_along(&way, upper), point_along(&way, upper + lower));
        bones.point(&mut aimed, [elbow - begin, wrist - elbow]);
    }
    aimed
}

/// Eqs. 16 and 17: from the middle of the garment's joints to the middle of the figure's.
fn shift_of_pair(figure: &Figure, pose: &Pose, limbs: &[Limb], joint: OfSide) -> Vec3 {
    let joints = figure.skeleton.joints_in_world(pose);
    let mut shift = Vec3::zeros();
    for (side, limb) in Side::BOTH.into_iter().zip(limbs) {
        let (Some(j), Some(first)) = (figure.skeleton.find(joint(side)), limb.nodes.first()) else { continue };
        let radius = limb.girths.first().map_or(0.0, |girth| girth / std::f64::consts::TAU);
        let inner = first - limb.direction().unwrap_or_else(Vec3::zeros) * radius;
        shift += (joints[j.index()] - inner) * 0.5;
    }
    shift
}

/// The point of the body's axis at which it is as wide as a rim: the lowest one from the narrowest level of the trunk down.
pub(super) fn where_it_fits(figure: &Figure, girth: f64) -> Point {
    /// Between the levels tried, in metres.
    const STEP: f64 = 0.01;
    let (skeleton, body) = (&figure.skeleton, figure.body());
    let joint = |joint| skeleton.find(joint).map_or(Point::origin(), |j| skeleton.joints_in_bind[j.index()]);
    let (low, high) = (joint(HumanJoint::UpperLeg(Side::Left)).y, joint(HumanJoint::Chest).y);
    let heights: Vec<f64> = (0..).map(|k| high - STEP * f64::from(k)).take_while(|y| *y >= low).collect();
    let girths = trunk_girths(&body.mesh, &body.weights, skeleton, &heights);
    let levels: Vec<(f64, f64)> = heights.into_iter().zip(girths).filter_map(|(y, girth)| Some((y, girth?))).collect();
    let narrowest = (0..levels.len()).min_by(|&a, &b| levels[a].1.total_cmp(&levels[b].1)).unwrap_or(0);
    let fitting = levels.iter().skip(narrowest).take_while(|(_, around)| *around <= girth).last();
    let y = fitting.or(levels.get(narrowest)).map_or(high, |(y, _)| *y);
    let hips = joint(HumanJoint::Hips);
    Point::new(hips.x, y, hips.z)
}

/// The shift near a first one with the least cloth inside the body and the least gap, and its cost.
fn settled(garment: &TriMesh, body: &SurfaceIndex, first: Vec3, searched: f64) -> (Vec3, f64) {
    let every = (garment.vertex_count() / JUDGED).max(1);
    let judged: Vec<Point> = garment.points().iter().step_by(every).copied().collect();
    let cost = |shift: &Vec3| -> f64 {
        use rayon::prelude::*;
        let signed: Vec<f64> = judged.par_iter().map(|p| body.signed_distance(&(p + shift))).collect();
        let depth = signed.iter().map(|d| (-d).max(0.0)).sum::<f64>() / signed.len().max(1) as f64;
        let gap = signed.iter().map(|d| d.max(0.0)).sum::<f64>() / signed.len().max(1) as f64;
        depth + GAP_COUNTS * gap
    };
    let (mut best, mut least) = (first, cost(&first));
    let mut step = searched / 4.0;
    while step > 0.002 {
        let mut moved = false;
        for axis in [1, 2, 0] {
            for sign in [-1.0, 1.0] {
                let mut next = best;
                next[axis] += sign * step;
                if (next - first).norm() > searched {
                    continue;
                }
                let tried = cost(&next);
                if tried < least {
                    (best, least, moved) = (next, tried, true);
                }
            }
        }
        if !moved {
            step *= 0.5;
        }
    }
    (best, least)
}
