//! Learns a body model from bodies of one topology.

use super::components::{Components, principal_components};
use super::error::TrainError;
use super::leave_out::{self, HoldOutErrors};
use super::params::TrainParams;
use super::progress::TrainingProgress;
use super::rig::{Regressor, Rig};
use super::subjects::Subjects;
use super::unpose;
use crate::body::{BodyModel, Skeleton};
use crate::geometry::{PerVertex, Point, TriMesh};

/// A model with measurements of the training.
#[derive(Clone, Debug)]
pub struct Trained {
    /// The model.
    pub model: BodyModel,
    /// `K` cumulative shares of the variance.
    pub explained: Vec<f64>,
    /// Number of bodies trained on.
    pub bodies: usize,
    /// Errors on the bodies left out; `None` if none was.
    pub left_out: Option<HoldOutErrors>,
}

/// Trains a model on bodies of one topology.
///
/// **Errors** fewer bodies than components, an open template; see [`TrainError`].
///
/// **Guarantees** deterministic.
pub fn train(
    subjects: &Subjects,
    rig: &Rig,
    params: &TrainParams,
    on_step: &mut dyn FnMut(&TrainingProgress),
) -> Result<Trained, TrainError> {
    params.check(subjects.bodies.len())?;
    let (kept, left) = leave_out::split(subjects.bodies.len(), params.leave_out);
    let regressor = rig.joint_regressor()?;
    let mut poses = Vec::new();
    let mut in_bind = subjects.bodies.clone();
    if params.unpose {
        let unposed = unpose::into_mean_pose(subjects, rig, &regressor, &kept, on_step);
        (in_bind, poses) = unposed;
    }
    on_step(&TrainingProgress { doing: "principal components", done: 0, total: 1 });
    let trained_on: Vec<&PerVertex<Point>> = kept.iter().map(|&b| &in_bind[b]).collect();
    let components =
        principal_components(&trained_on, params.components).ok_or(TrainError::NoComponents { bodies: kept.len() })?;
    let explained = components.explained.clone();
    let left_out =
        (!left.is_empty()).then(|| leave_out::measure(subjects, rig, &regressor, &components, &left, &in_bind, &poses));
    let model = model_of(&subjects.template, rig, regressor, components);
    on_step(&TrainingProgress { doing: "principal components", done: 1, total: 1 });
    Ok(Trained { model, explained, bodies: kept.len(), left_out })
}

fn model_of(template: &TriMesh, rig: &Rig, joint_regressor: Regressor, components: Components) -> BodyModel {
    let mean = template.with_points(components.mean);
    let shape_dirs: Vec<PerVertex<_>> = components
        .directions
        .into_iter()
        .zip(&components.sigma)
        .map(|(direction, sigma)| direction.iter().map(|d| d * *sigma).collect())
        .collect();
    let joint_dirs = shape_dirs
        .iter()
        .map(|dirs| joint_regressor.iter().map(|row| row.iter().map(|&(v, m)| dirs[v] * m).sum()).collect())
        .collect();
    let mut model = BodyModel {
        skeleton: Skeleton { names: rig.names.clone(), parents: rig.parents.clone(), joints_in_bind: Vec::new() },
        template: mean,
        shape_dirs,
        joint_regressor,
        joint_dirs,
        weights: rig.weights.clone(),
        limits: rig.limits.clone(),
        uvs: rig.uvs.clone(),
        mirror: rig.mirror.clone(),
    };
    model.skeleton = model.skeleton_inside(model.template.points());
    model
}
