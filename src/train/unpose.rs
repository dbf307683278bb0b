//! Limbs turned into the mean body's pose, so that shape is learnt and not posture.

use super::components::mean_body;
use super::leave_out::skeleton_of;
use super::progress::TrainingProgress;
use super::rig::{Regressor, Rig};
use super::subjects::Subjects;
use crate::body::HumanJoint::{self, Foot, Hand, Head, LowerArm, LowerLeg, Neck, UpperArm, UpperLeg};
use crate::body::Side::{Left, Right};
use crate::body::{Pose, unskin};
use crate::geometry::{PerVertex, Point, Vec3};
use nalgebra::{Matrix3, UnitQuaternion};
use rayon::prelude::*;

/// Joints whose turn is taken out: those that people hold differently. Turns of trunk and shoulder girdle cannot be
/// told from a belly or from broad shoulders, and stay in the shape.
const TURNED: [HumanJoint; 14] = [
    Neck,
    Head,
    UpperArm(Left),
    LowerArm(Left),
    Hand(Left),
    UpperArm(Right),
    LowerArm(Right),
    Hand(Right),
    UpperLeg(Left),
    LowerLeg(Left),
    Foot(Left),
    UpperLeg(Right),
    LowerLeg(Right),
    Foot(Right),
];
/// The mean of unposed bodies is a better reference than the first mean; after two rounds it stands still.
const ROUNDS: usize = 2;

/// Every body in the pose of the mean of those in `kept`, and for each the pose that carries it back.
pub(super) fn into_mean_pose(
    subjects: &Subjects,
    rig: &Rig,
    regressor: &Regressor,
    kept: &[usize],
    on_step: &mut dyn FnMut(&TrainingProgress),
) -> (Vec<PerVertex<Point>>, Vec<Pose>) {
    let mut in_bind = subjects.bodies.clone();
    let mut poses = vec![Pose::bind(regressor.len()); in_bind.len()];
    for round in 0..ROUNDS {
        on_step(&TrainingProgress { doing: "unposing", done: round, total: ROUNDS });
        let mean = mean_body(&kept.iter().map(|&b| &in_bind[b]).collect::<Vec<_>>()).unwrap_or_default();
        (in_bind, poses) = subjects
            .bodies
            .par_iter()
            .map(|body| {
                let rotations = turns(rig, &mean, body);
                carried_back(rig, regressor, body, rotations)
            })
            .unzip();
    }
    (in_bind, poses)
}

/// The rotation of each joint that carries `from` onto `to`: its part's own best rotation, seen from its parent's.
fn turns(rig: &Rig, from: &PerVertex<Point>, to: &PerVertex<Point>) -> Vec<UnitQuaternion<f64>> {
    let mut in_world: Vec<UnitQuaternion<f64>> = Vec::with_capacity(rig.parents.len());
    let mut local = Vec::with_capacity(rig.parents.len());
    for (j, parent) in rig.parents.iter().enumerate() {
        let above = parent.map_or_else(UnitQuaternion::identity, |p| in_world[p.index()]);
        let is_turned = HumanJoint::from_name(&rig.names[j]).is_some_and(|joint| TURNED.contains(&joint));
        let own = if is_turned { part_rotation(rig, j, from, to) } else { None };
        let own = own.unwrap_or(above);
        local.push(above.inverse() * own);
        in_world.push(own);
    }
    local
}

/// Kabsch over the vertices that follow joint `j` for the most part; `None` where there are too few.
fn part_rotation(rig: &Rig, j: usize, from: &PerVertex<Point>, to: &PerVertex<Point>) -> Option<UnitQuaternion<f64>> {
    /// Vertices that follow a joint less than this bend with the next one.
    const LEAST_WEIGHT: f64 = 0.7;
    /// Fewer vertices than these have no sure orientation.
    const FEWEST: usize = 12;
    let part: Vec<(usize, f64)> = rig
        .weights
        .rows()
        .iter()
        .enumerate()
        .filter(|(_, row)| row[0].0.index() == j && row[0].1 >= LEAST_WEIGHT)
        .map(|(v, row)| (v, row[0].1))
        .collect();
    if part.len() < FEWEST {
        return None;
    }
    let total: f64 = part.iter().map(|p| p.1).sum();
    let center = |points: &PerVertex<Point>| part.iter().map(|&(v, w)| points.0[v].coords * w).sum::<Vec3>() / total;
    let (a, b) = (center(from), center(to));
    let products = part.iter().map(|&(v, w)| (to.0[v].coords - b) * (from.0[v].coords - a).transpose() * w);
    let covariance: Matrix3<f64> = products.sum();
    let svd = covariance.svd(true, true);
    let (u, v) = (svd.u?, svd.v_t?);
    let mut flip = Matrix3::identity();
    flip[(2, 2)] = (u * v).determinant().signum();
    Some(UnitQuaternion::from_matrix(&(u * flip * v)))
}

/// Bind-pose points and the pose that skins them into `body`: joints follow from the points and the points from the
/// joints, repeated until both agree.
fn carried_back(
    rig: &Rig,
    regressor: &Regressor,
    body: &PerVertex<Point>,
    rotations: Vec<UnitQuaternion<f64>>,
) -> (PerVertex<Point>, Pose) {
    /// Each round shrinks what is left to about a third.
    const ROUNDS: usize = 8;
    let mut pose = Pose { translation: Vec3::zeros(), rotations };
    let mut skeleton = skeleton_of(rig, regressor, body);
    let root = skeleton.joints_in_bind[0];
    for _ in 0..ROUNDS {
        let points = unskin(body, &rig.weights, &skeleton, &pose);
        skeleton.joints_in_bind = skeleton_of(rig, regressor, &points).joints_in_bind;
        // The root stays where it stood: bodies keep their soles on the ground.
        pose.translation = root - skeleton.joints_in_bind[0];
    }
    let points = unskin(body, &rig.weights, &skeleton, &pose);
    (points, pose)
}
