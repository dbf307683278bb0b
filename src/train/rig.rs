//! What a model needs besides shapes: joints, skin weights, and what goes with them.

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
/// **Shapes** `weights` and `mirror` have one entry a vertex of `mesh`, the rest one a joint.
#[derive(Clone, Debug)]
pub struct Rig {
    /// The body in which `joints` lie, closed.
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
    /// The vertex that each becomes when left and right are exchanged.
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
    /// each vertex takes the weights of the closest place. Joints are the given ones where there are some.
    ///
    /// **Requires** bodies upright, in metres. The bodies come back turned to face +Z.
    ///
    /// **Errors** where the mean body is open, or the model does not fit.
    pub fn for_subjects(subjects: Subjects, kept: &[usize], model: &BodyModel) -> Result<(Subjects, Self), TrainError> {
        /// A heading less than this off is left: it is the fit's, not the bodies'. Radians.
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
        // Corrective offsets count from the template's bind pose, which is not that of these bodies.
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

    /// Joints as sums of vertices, by mean value coordinates (Hu 2017, Eq. 1).
    ///
    /// **Errors** where the mesh is open.
    pub(super) fn joint_regressor(&self) -> Result<Regressor, TrainError> {
        /// Factors below this share move no joint by a hundredth of a millimetre; left out, they would be all vertices.
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

/// The model's bounds count from its bind pose; in the new model that pose is `old`, so they are moved by it.
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
