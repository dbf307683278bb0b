//! One field of weights for all layers: cloth on cloth moves with the cloth below it.

use super::confidence::Matches;
use crate::body::{Figure, JointId, Layer, Pose, SkinWeights};
use crate::geometry::{Adjacency, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId};
use rayon::prelude::*;

/// Greatest distance to the cloth below, in metres: that of a coat over a jacket.
const FARTHEST: f64 = 0.03;
/// Least cosine between the normals of both, 45°: in a fold or at a cuff, what is near is not what lies below.
const LEAST_COSINE: f64 = 0.7;

/// The garments that the figure wears, posed into the scan.
pub(super) struct Below<'a> {
    worn: Vec<Worn<'a>>,
}

struct Worn<'a> {
    surface: SurfaceIndex,
    on_hem: PerVertex<bool>,
    weights: &'a SkinWeights,
}

/// The closest point of the cloth below a vertex.
struct Near {
    distance: f64,
    cosine: f64,
    row: Vec<(JointId, f64)>,
}

impl<'a> Below<'a> {
    pub fn prepare(figure: &'a Figure, pose: &Pose) -> Self {
        let worn = |layer: &'a Layer| Worn {
            surface: SurfaceIndex::prepare(&layer.posed(&figure.skeleton, pose)),
            on_hem: Adjacency::prepare(&layer.mesh).boundary_vertices(),
            weights: &layer.weights,
        };
        Self { worn: figure.garments().par_iter().map(worn).collect() }
    }

    /// Matches a garment with the cloth on which it lies instead of the body, where it lies on any.
    ///
    /// What the cloth below gained by smoothing, where skinning tears it, the garment has then from the start; and both move
    /// alike, so that they stay one above the other.
    pub fn take_over(&self, garment: &TriMesh, matches: &mut Matches) {
        if self.worn.is_empty() {
            return;
        }
        let normals = garment.vertex_normals();
        let found: Vec<Option<Near>> = garment
            .points()
            .0
            .par_iter()
            .zip(normals.0.par_iter())
            .map(|(p, normal)| self.nearest(p, normal))
            .collect();
        for (v, near) in found.into_iter().enumerate() {
            if let Some(near) = near {
                let v = VertexId::from_index(v);
                matches.rows[v] = near.row;
                matches.cosines[v] = near.cosine;
                matches.gaps[v] = near.distance.min(matches.distances[v]);
            }
        }
    }

    fn nearest(&self, p: &Point, normal: &Vec3) -> Option<Near> {
        let mut nearest: Option<Near> = None;
        for worn in self.worn.iter().rev() {
            let reach = nearest.as_ref().map_or(FARTHEST, |near| near.distance);
            nearest = worn.nearest(p, normal, reach).or(nearest);
        }
        nearest
    }
}

impl Worn<'_> {
    fn nearest(&self, p: &Point, normal: &Vec3, reach: f64) -> Option<Near> {
        let at = self.surface.closest_within(p, reach)?;
        let corners = self.surface.mesh().faces()[at.face];
        let is_beyond_hem = corners.iter().zip(at.barycentric).all(|(&v, share)| share == 0.0 || self.on_hem[v]);
        let cosine = self.surface.mesh().face_normal(at.face).dot(normal);
        let parts: [_; 3] = std::array::from_fn(|k| (corners[k], at.barycentric[k]));
        (!is_beyond_hem && cosine >= LEAST_COSINE).then(|| Near {
            distance: at.distance,
            cosine,
            row: self.weights.blend(&parts),
        })
    }
}
