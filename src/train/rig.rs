//! The rig of a model: joints, skin weights, limits and texture coordinates.

use super::error::TrainError;
use super::subjects::Subjects;
use crate::body::{BodyModel, JointId, JointLimits, Pose, SkinWeights, UvMap, skin};
use crate::fit::{NakedParams, RegisterParams, closest_weights, fit_naked, register};
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, Vec3, VertexId, mean_value_coordinates};
use crate::scan::Scan;
use nalgebra::UnitQuaternion;

/// Per joint the vertices and factors whose weighted sum is the joint centre.
pub(super) type Regressor = Vec<Vec<(VertexId, f64)>>;

/// Joints and weights for a mesh.
///
/// **Shapes** `weights` and `mirror`: one entry per vertex of `mesh`; `names`, `parents`, `joints`: one per joint; `limits`:
/// one per joint, or none.
#[derive(Clone, Debug)]
pub struct Rig {
    /// The closed body around `joints`.
    pub mesh: TriMesh,
    /// VRM names.
    pub names: Vec<String>,
    /// Parents come before their children.
    pub parents: Vec<Option<JointId>>,
    /// Joint centres in `mesh`.
    pub joints: Vec<Point>,
    /// Skin weights.
    pub weights: SkinWeights,
    /// Bounds of the joints' rotations; may be empty.
    pub limits: Vec<JointLimits>,
    /// Texture coordinates.
    pub uvs: Option<UvMap>,
    /// Per vertex its counterpart on the other side.
    pub mirror: Option<PerVertex<VertexId>>,
}

impl Rig {
    /// The model's own rig.
    pub fn of_model(model: &BodyModel) -> Self {
        Self {
            mesh: model.template.clone(),
            names: model.skeleton.names.clone(),
            parents: model.skeleton.parents.clone(),
            joints: model.skeleton.joints_in_bind.clone(),
            weights: model.weights.clone(),
            limits: model.limits.clone(),
            uvs: model.uvs.clone(),
            mirror: model.mirror.clone(),
        }
    }

    /// The rig of `model` for bodies of another topology: the model is fitted to the mean of `kept` and moved onto it;
    /// each vertex takes the weights of the closest point. Given joints have priority.
    ///
    /// **Requires** bodies upright, in metres. They are turned to face +Z.
    ///
    /// **Errors** if the mean body is open, or the model does not fit.
    pub fn for_subjects(subjects: Subjects, kept: &[usize], model: &BodyModel) -> Result<(Subjects, Self), TrainError> {
        /// Greatest heading that is not corrected, in radians: it is an error of the fit.
        const SURE_HEADING: f64 = 0.3;
        let mesh = subjects.mean_of(kept);
        check_closed(&mesh)?;
        let failed = |source| TrainError::NotABody { name: "the mean of the bodies".into(), source };
        let scan = Scan::from_clean_mesh(mesh.clone(), None);
        let fitted = fit_naked(&scan, model, &NakedParams::default(), &mut |_| {}).map_err(failed)?;
        let facing = fitted.pose.rotations[0] * Vec3::z();
        let heading = facing.x.atan2(facing.z);
        if heading.abs() > SURE_HEADING {
            let turn = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), -heading);
            return Self::for_subjects(subjects.map_points(|p| turn * p), kept, model);
        }
        let params = RegisterParams::default();
        let registered = register(&scan, model, &fitted, &params, &mut |_| {}).map_err(failed)?;
        let skeleton = &registered.skeleton;
        let points = skin(registered.surface.points(), &model.weights, skeleton, &registered.pose);
        let weights = closest_weights(mesh.points(), &registered.surface.with_points(points), &model.weights);
        // Corrective offsets refer to the template's bind pose, which is not that of these bodies.
        let weights = weights.rigid();
        let joints = subjects.mean_joints_of(kept).unwrap_or_else(|| skeleton.joints_in_world(&registered.pose));
        let rig = Self {
            mesh,
            names: skeleton.names.clone(),
            parents: skeleton.parents.clone(),
            joints,
            weights,
            limits: limits_from(model, &registered.pose),
            uvs: None,
            mirror: None,
        };
        Ok((subjects, rig))
    }

    /// Joints as weighted sums of vertices, by mean value coordinates (Hu 2017, Eq. 1).
    ///
    /// **Errors** if the mesh is open.
    pub(super) fn joint_regressor(&self) -> Result<Regressor, TrainError> {
        /// Least factor kept: smaller ones move no joint by 0.01 mm, and with them every vertex would be in every row.
        const LEAST: f64 = 1e-9;
        check_closed(&self.mesh)?;
        let row = |joint: &Point| {
            let weights = mean_value_coordinates(&self.mesh, joint);
            weights.enumerate().filter(|(_, w)| w.abs() > LEAST).map(|(v, &w)| (v, w)).collect()
        };
        Ok(self.joints.iter().map(row).collect())
    }
}

fn check_closed(mesh: &TriMesh) -> Result<(), TrainError> {
    match Adjacency::prepare(mesh).boundary_edges().len() {
        0 => Ok(()),
        edges => Err(TrainError::OpenTemplate { edges }),
    }
}

/// The model's bounds refer to its bind pose, which is `old` in the new model: moves them by that pose.
fn limits_from(model: &BodyModel, old: &Pose) -> Vec<JointLimits> {
    model
        .limits
        .iter()
        .zip(&old.rotations)
        .map(|(limits, rotation)| {
            let offset = rotation.scaled_axis();
            JointLimits { min: limits.min - offset, max: limits.max - offset }
        })
        .collect()
}
