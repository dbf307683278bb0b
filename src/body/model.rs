//! The statistical body model.

use super::{JointLimits, Pose, Skeleton, SkinWeights, UvMap, skin};
use crate::geometry::{PerVertex, Point, TriMesh, Vec3, VertexId};
use serde::{Deserialize, Serialize};

/// Coordinates in the model's shape space, each in standard deviations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Shape(pub Vec<f64>);

/// A linear shape space over one mesh, with joints and skin weights.
///
/// **Shapes** `V` vertices, `K` components, `J` joints.
///
/// **Frame and units** metres, Y up, facing +Z, in the model's own bind pose.
///
/// **Source** Hu 2017, Eqs. 1–3: `S(β) = mean + Σ βᵢ σᵢ μᵢ` ([`Self::shaped`]); joints by a linear regressor made of mean
/// value coordinates.
#[derive(Clone, Debug)]
pub struct BodyModel {
    /// The mean body.
    pub template: TriMesh,
    /// `K × V × 3` directions `σ_k μ_k`, in metres per standard deviation.
    pub shape_dirs: Vec<PerVertex<Vec3>>,
    /// Per joint the vertices and factors whose weighted sum is the joint centre.
    pub joint_regressor: Vec<Vec<(VertexId, f64)>>,
    /// The mean body's skeleton.
    pub skeleton: Skeleton,
    /// `K × J × 3`: how each joint moves with each component, in metres per standard deviation.
    pub joint_dirs: Vec<Vec<Vec3>>,
    /// Skin weights, with the corrective offsets if the model has them.
    pub weights: SkinWeights,
    /// Bounds of each joint's rotation vector: one per joint, or none.
    pub limits: Vec<JointLimits>,
    /// Texture coordinates.
    pub uvs: Option<UvMap>,
    /// Per vertex its counterpart on the other side.
    pub mirror: Option<PerVertex<VertexId>>,
}

impl BodyModel {
    /// The number of shape components, `K`.
    pub fn component_count(&self) -> usize {
        self.shape_dirs.len()
    }

    /// The mean shape.
    pub fn mean_shape(&self) -> Shape {
        Shape(vec![0.0; self.component_count()])
    }

    /// The body of that shape and its skeleton, in the bind pose: Eq. 2 and Eq. 1.
    pub fn shaped(&self, shape: &Shape) -> (TriMesh, Skeleton) {
        let mut points = self.template.points().clone();
        for (k, &beta) in shape.0.iter().enumerate().take(self.component_count()) {
            if beta == 0.0 {
                continue;
            }
            for (p, d) in points.0.iter_mut().zip(self.shape_dirs[k].iter()) {
                *p += d * beta;
            }
        }
        (self.template.with_points(points), self.skeleton_of(shape))
    }

    /// The skeleton of the body of that shape: Eq. 1.
    pub fn skeleton_of(&self, shape: &Shape) -> Skeleton {
        let mut skeleton = self.skeleton.clone();
        for (dirs, &beta) in self.joint_dirs.iter().zip(&shape.0) {
            for (p, d) in skeleton.joints_in_bind.iter_mut().zip(dirs) {
                *p += d * beta;
            }
        }
        skeleton
    }

    /// A surface with this model's vertices, skinned into `pose`: Eq. 3, with the corrective offsets of the model.
    ///
    /// **Shapes** `V × 3` in and out.
    pub fn posed(&self, points_in_bind: &PerVertex<Point>, skeleton: &Skeleton, pose: &Pose) -> PerVertex<Point> {
        skin(points_in_bind, &self.weights, skeleton, pose)
    }

    /// The skeleton inside any surface with this model's vertices, in the bind pose: Eq. 1.
    ///
    /// **Shapes** `points_in_bind` `V × 3`.
    pub fn skeleton_inside(&self, points_in_bind: &PerVertex<Point>) -> Skeleton {
        Skeleton {
            joints_in_bind: self
                .joint_regressor
                .iter()
                .map(|row| row.iter().fold(Point::origin(), |sum, &(v, m)| sum + points_in_bind[v].coords * m))
                .collect(),
            ..self.skeleton.clone()
        }
    }
}
