//! An articulated surface in one pose, and the residuals on it.

use crate::body::{Skeleton, SkinWeights};
use crate::geometry::{PerVertex, Point, Vec3, VertexId};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion};

/// An articulated surface in one pose, with everything that its Jacobian needs.
pub(crate) struct Posed {
    pub(crate) points: PerVertex<Point>,
    pub(crate) skeleton: Skeleton,
    pub(crate) joints_in_world: Vec<Point>,
    pub(super) points_in_bind: PerVertex<Point>,
    pub(crate) world_from_bind: Vec<Isometry3<f64>>,
    /// The rotations of `world_from_bind` as matrices.
    pub(super) rotations: Vec<Matrix3<f64>>,
    /// Derivative of the translation of each joint's transform by each shape component. **Shapes** `J × K`.
    pub(super) translation_dirs: Vec<Vec<Vec3>>,
}

impl Posed {
    /// Normals of the bind pose, rotated with the points.
    pub(crate) fn normals(&self, normals_in_bind: &PerVertex<Vec3>, weights: &SkinWeights) -> PerVertex<Vec3> {
        normals_in_bind
            .iter()
            .zip(weights.rows().iter())
            .map(|(n, row)| {
                let turned: Vec3 = row.iter().map(|(j, w)| self.world_from_bind[j.index()].rotation * n * *w).sum();
                turned.try_normalize(1e-9).unwrap_or(*n)
            })
            .collect()
    }
}

/// One weighted squared residual `weight · (normal · Σ factor · Δvertex − gap)²`, with Δ the move of a step.
#[derive(Clone, Debug)]
pub(crate) struct Residual {
    pub(crate) at: [(VertexId, f64); 3],
    pub(crate) normal: Vec3,
    pub(crate) gap: f64,
    pub(crate) weight: f64,
}

impl Residual {
    pub(crate) fn on_vertex(vertex: VertexId, normal: Vec3, gap: f64, weight: f64) -> Self {
        Self { at: [(vertex, 1.0), (vertex, 0.0), (vertex, 0.0)], normal, gap, weight }
    }

    /// Point to point: one residual per axis, whose squares add up to that of the distance.
    pub(crate) fn toward(vertex: usize, gap: Vec3, weight: f64) -> [Self; 3] {
        let vertex = VertexId::from_index(vertex);
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        std::array::from_fn(|k| Self::on_vertex(vertex, axes[k], gap[k], weight))
    }
}

pub(crate) fn parent_rotation(posed: &Posed, joint: usize) -> UnitQuaternion<f64> {
    match posed.skeleton.parents[joint] {
        Some(p) => posed.world_from_bind[p.index()].rotation,
        None => UnitQuaternion::identity(),
    }
}
