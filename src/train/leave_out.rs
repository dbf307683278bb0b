//! How well a model represents bodies that it was not trained on.

use super::components::Components;
use super::rig::{Regressor, Rig};
use super::subjects::Subjects;
use crate::body::{Pose, Skeleton, skin};
use crate::geometry::{PerVertex, Point};
use serde::Serialize;

/// Errors on bodies left out of the training, in metres.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HoldOutErrors {
    /// The number of bodies.
    pub bodies: usize,
    /// Mean distance between the vertices of a body and those of its projection onto the components, posed back.
    pub vertex_mean: f64,
    /// This distance for the worst body.
    pub vertex_worst: f64,
    /// Mean distance between the joints of the projection and the given joints, or those regressed from the body itself.
    pub joint_mean: f64,
    /// Mean over the bodies for the worst joint.
    pub joint_worst: f64,
    /// Its name.
    pub worst_joint: String,
    /// Whether the joints were given.
    pub joints_given: bool,
}

/// The bodies to train on and those left out, evenly over the list.
pub fn split(bodies: usize, leave_out: usize) -> (Vec<usize>, Vec<usize>) {
    let leave_out = leave_out.min(bodies);
    let is_left = |b: usize| (b + 1) * leave_out / bodies.max(1) > b * leave_out / bodies.max(1);
    (0..bodies).partition(|&b| !is_left(b))
}

/// Measures the errors on the bodies `left`; `poses` is empty if nothing was unposed.
pub(super) fn measure(
    subjects: &Subjects,
    rig: &Rig,
    regressor: &Regressor,
    components: &Components,
    left: &[usize],
    in_bind: &[PerVertex<Point>],
    poses: &[Pose],
) -> HoldOutErrors {
    let joints_given = subjects.joints.as_ref();
    let mut vertex_errors = Vec::new();
    let mut joint_errors = vec![0.0; regressor.len()];
    for &b in left {
        let made = components.nearest(&in_bind[b]);
        let skeleton = skeleton_of(rig, regressor, &made);
        let pose = poses.get(b).cloned().unwrap_or_else(|| Pose::bind(regressor.len()));
        let posed = skin(&made, &rig.weights, &skeleton, &pose);
        vertex_errors.push(mean_distance(&posed, &subjects.bodies[b]));
        let truth = match joints_given {
            Some(given) => given.of_body[b].clone(),
            None => {
                let own = skeleton_of(rig, regressor, &in_bind[b]);
                own.joints_in_world(&pose)
            }
        };
        for (error, (p, q)) in joint_errors.iter_mut().zip(skeleton.joints_in_world(&pose).iter().zip(&truth)) {
            *error += (p - q).norm() / left.len() as f64;
        }
    }
    HoldOutErrors {
        bodies: left.len(),
        vertex_mean: mean(&vertex_errors),
        vertex_worst: vertex_errors.iter().copied().fold(0.0, f64::max),
        joint_mean: mean(&joint_errors),
        joint_worst: joint_errors.iter().copied().fold(0.0, f64::max),
        worst_joint: (0..joint_errors.len())
            .reduce(|a, b| if joint_errors[b] > joint_errors[a] { b } else { a })
            .map_or_else(String::new, |j| rig.names[j].clone()),
        joints_given: joints_given.is_some(),
    }
}

/// The rig's skeleton for these points.
pub(super) fn skeleton_of(rig: &Rig, regressor: &Regressor, points: &PerVertex<Point>) -> Skeleton {
    let at = |row: &Vec<_>| row.iter().fold(Point::origin(), |sum, &(v, m)| sum + points[v].coords * m);
    Skeleton {
        names: rig.names.clone(),
        parents: rig.parents.clone(),
        joints_in_bind: regressor.iter().map(at).collect(),
    }
}

fn mean_distance(a: &PerVertex<Point>, b: &PerVertex<Point>) -> f64 {
    a.iter().zip(b.iter()).map(|(p, q)| (p - q).norm()).sum::<f64>() / a.len().max(1) as f64
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bodies_are_left_out_evenly() {
        let (kept, left) = split(60, 10);
        assert_eq!((kept.len(), left.len()), (50, 10));
        assert!(left.windows(2).all(|w| w[1] - w[0] == 6));
        assert_eq!(split(5, 0), (vec![0, 1, 2, 3, 4], vec![]));
        assert_eq!(split(3, 9), (vec![], vec![0, 1, 2]));
    }
}
