//! The closest point of the body for each vertex of a garment, and the confidence in it.

use super::params::RigParams;
use crate::body::{JointId, SkinWeights};
use crate::geometry::{PerVertex, SurfaceIndex, TriMesh, Vec3, VertexId};
use rayon::prelude::*;

/// The closest triangle of the body, and from where the weights are taken, per vertex of the garment.
///
/// **Shapes** every array has one entry per vertex of the garment.
pub(super) struct Matches {
    /// Interpolated skin weights, not pruned.
    pub rows: PerVertex<Vec<(JointId, f64)>>,
    /// Corners of that triangle, with barycentric coordinates.
    pub places: Vec<[(VertexId, f64); 3]>,
    /// Distance to the body, in metres.
    pub distances: PerVertex<f64>,
    /// Distance to the surface from which the weights are taken, in metres: the body, or cloth on it.
    pub gaps: PerVertex<f64>,
    /// Cosine between the normals of the garment and that surface.
    pub cosines: PerVertex<f64>,
    /// The body's interpolated unit normal at the closest point.
    pub body_normals: PerVertex<Vec3>,
}

pub(super) fn match_with_body(garment: &TriMesh, body: &SurfaceIndex, body_weights: &SkinWeights) -> Matches {
    let (normals, body_normals) = (garment.vertex_normals(), body.mesh().vertex_normals());
    let found: Vec<_> = garment
        .points()
        .0
        .par_iter()
        .zip(normals.0.par_iter())
        .map(|(p, normal)| {
            let at = body.closest(p);
            let corners = body.mesh().faces()[at.face];
            let parts: [_; 3] = std::array::from_fn(|k| (corners[k], at.barycentric[k]));
            let body_normal: Vec3 = parts.iter().map(|&(v, share)| body_normals[v] * share).sum();
            let body_normal = body_normal.try_normalize(1e-12).unwrap_or_else(Vec3::zeros);
            (parts, body_weights.blend(&parts), at.distance, normal.dot(&body_normal), body_normal)
        })
        .collect();
    let mut matches = Matches {
        rows: PerVertex(Vec::with_capacity(found.len())),
        places: Vec::with_capacity(found.len()),
        distances: PerVertex(Vec::with_capacity(found.len())),
        gaps: PerVertex(Vec::with_capacity(found.len())),
        cosines: PerVertex(Vec::with_capacity(found.len())),
        body_normals: PerVertex(Vec::with_capacity(found.len())),
    };
    for (place, row, distance, cosine, normal) in found {
        matches.places.push(place);
        matches.rows.0.push(row);
        matches.distances.0.push(distance);
        matches.gaps.0.push(distance);
        matches.cosines.0.push(cosine);
        matches.body_normals.0.push(normal);
    }
    matches
}

/// Confidence of each match: 1 where cloth lies on the body and faces the same way, falling to 0 with distance and angle.
///
/// **Shapes** one value in 0–1 per vertex.
///
/// **Source** Abdrashitov 2023, §3.1, with ramps in place of its two thresholds, so that noisy normals near a threshold
/// cause no seam.
pub(super) fn match_confidence(matches: &Matches, posed_body: &TriMesh, params: &RigParams) -> PerVertex<f64> {
    let diagonal = posed_body.bounds().map_or(0.0, |b| b.extent().norm());
    let farthest = params.distance_per_diagonal * diagonal;
    matches
        .gaps
        .iter()
        .zip(matches.cosines.iter())
        .map(|(&distance, &cosine)| {
            let angle_deg = cosine.clamp(-1.0, 1.0).acos().to_degrees();
            ramp_down(distance, 0.5 * farthest, farthest)
                * ramp_down(angle_deg, params.trusted_angle_deg, params.rejected_angle_deg)
        })
        .collect()
}

impl Matches {
    /// The body vertices whose corrective offsets each garment vertex follows: those of the closest triangle, fully up to
    /// 3 cm from it and not at all from 8 cm on, where cloth hangs and the closest points of neighbours lie on other limbs.
    ///
    /// **Shapes** one list of (vertex, factor) per garment vertex.
    pub fn followed_vertices(&self) -> impl Iterator<Item = Vec<(VertexId, f64)>> {
        self.places.iter().zip(self.distances.iter()).map(|(place, &distance)| {
            let share = ramp_down(distance, 0.03, 0.08);
            place.iter().filter(|(_, s)| s * share > 0.0).map(|&(v, s)| (v, s * share)).collect()
        })
    }
}

/// 1 up to `from`, 0 from `to` on, smooth in between.
pub(super) fn ramp_down(value: f64, from: f64, to: f64) -> f64 {
    let t = ((to - value) / (to - from).max(1e-12)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
