//! Turns limbs into the mean body's pose, so that the model learns shape and not posture.

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

/// Joints whose rotation is removed: those that people hold differently. Rotations of trunk and shoulder girdle cannot be
/// distinguished from a belly or broad shoulders, and stay in the shape.
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
/// Number of rounds: the mean of unposed bodies is a better reference than the first mean; two rounds converge.
const ROUNDS: usize = 2;

/// Every body in the pose of the mean of those in `kept`, and per body the pose that skins it back.
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
        let mean = mean_body(&kept.iter().map(|&b| &in_bind[b]).collect::<Vec<_>>());
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

/// The rotation of each joint that moves `from` onto `to`: the best rotation of its part relative to its parent's.
///
/// **Shapes** one per joint.
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

/// Kabsch algorithm over the vertices that mostly follow joint `j`; `None` if there are too few.
fn part_rotation(rig: &Rig, j: usize, from: &PerVertex<Point>, to: &PerVertex<Point>) -> Option<UnitQuaternion<f64>> {
    /// Least weight: vertices that follow a joint less bend with the next one.
    const LEAST_WEIGHT: f64 = 0.7;
    /// Least number of vertices that determine an orientation.
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
/// joints, so both are iterated.
fn carried_back(
    rig: &Rig,
    regressor: &Regressor,
    body: &PerVertex<Point>,
    rotations: Vec<UnitQuaternion<f64>>,
) -> (PerVertex<Point>, Pose) {
    /// Each round reduces the error to about a third.
    const ROUNDS: usize = 8;
    let mut pose = Pose { translation: Vec3::zeros(), rotations };
    let mut skeleton = skeleton_of(rig, regressor, body);
    let root = skeleton.joints_in_bind[0];
    for _ in 0..ROUNDS {
        let points = unskin(body, &rig.weights, &skeleton, &pose);
        skeleton.joints_in_bind = skeleton_of(rig, regressor, &points).joints_in_bind;
        // The root stays in place: bodies keep their soles on the ground.
        pose.translation = root - skeleton.joints_in_bind[0];
    }
    let points = unskin(body, &rig.weights, &skeleton, &pose);
    (points, pose)
}
