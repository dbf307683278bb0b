//! How ragged the hems of a garment are.

use crate::geometry::{PerVertex, Point, TriMesh, VertexId};
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// The most ragged hem of a garment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RaggedHem {
    /// Its length relative to that of its smoothed line, both unrolled into a plane; 1 is smooth.
    pub length_per_smooth_length: f64,
    /// Its length in metres.
    pub length: f64,
    /// Where it is most ragged.
    pub at: Point,
    /// Height of that place above the lowest point of the scan, in metres.
    pub height: f64,
}

/// Shorter loops tell nothing, in metres: at a cuff of 21 cm a few triangles reach a ratio of 1.17 (the foreign man's pullover, which
/// looks smooth).
const LEAST_LENGTH: f64 = 0.3;
/// Standard deviation of the Gaussian along the hem, in metres: longer than a triangle, shorter than the corner of a coat.
const DEVIATION: f64 = 0.02;
/// Distance of the samples along a hem, in metres: a tenth of the deviation, so that the sum is the integral.
const SPACING: f64 = 0.002;
/// The Gaussian ends here, in deviations.
const REACH: f64 = 3.0;
/// Length of the piece of which the most ragged is named, in metres: longer than one corner.
const PIECE: f64 = 0.2;

/// The hem that is longest in relation to its smoothed line; `None` if all are short. `floor` is the height of the scan's lowest
/// point.
///
/// A hem is compared with its line within the cloth: it is unrolled into a plane by its turning there, which is π less the
/// angles of the faces at a vertex. The folds of a skirt, which bend cloth and do not stretch it, change nothing.
///
/// **Shapes** `hems`: the vertices of each hem, in order, closed.
pub fn most_ragged_hem(mesh: &TriMesh, hems: &[Vec<VertexId>], floor: f64) -> Option<RaggedHem> {
    let angles = angles_of_faces(mesh);
    let ragged = hems.iter().filter_map(|hem| raggedness(mesh, &angles, hem, floor));
    ragged.max_by(|a, b| a.length_per_smooth_length.total_cmp(&b.length_per_smooth_length))
}

/// The sum of the angles of the faces at each vertex, in radians.
pub(in crate::cut) fn angles_of_faces(mesh: &TriMesh) -> PerVertex<f64> {
    let mut angles = PerVertex::filled(0.0, mesh.vertex_count());
    for f in mesh.face_ids() {
        let (corners, points) = (mesh.faces()[f], mesh.triangle(f));
        for k in 0..3 {
            angles[corners[k]] += (points[(k + 1) % 3] - points[k]).angle(&(points[(k + 2) % 3] - points[k]));
        }
    }
    angles
}

/// How ragged one hem is; `None` if it is short. `angles` are those of [`angles_of_faces`].
pub(in crate::cut) fn raggedness(
    mesh: &TriMesh,
    angles: &PerVertex<f64>,
    hem: &[VertexId],
    floor: f64,
) -> Option<RaggedHem> {
    let point = |i: usize| mesh.points()[hem[i % hem.len()]];
    let edges: Vec<f64> = (0..hem.len()).map(|i| (point(i + 1) - point(i)).norm()).collect();
    let length: f64 = edges.iter().sum();
    if !length.is_finite() || length < LEAST_LENGTH {
        return None;
    }
    let count = (length / SPACING).round() as usize;
    let spacing = length / count as f64;
    // Of each sample, the edge that it is on, and the direction of that edge in the plane.
    let (mut edge, mut end, mut direction) = (0, edges[0], 0.0);
    let samples: Vec<(usize, f64)> = (0..count)
        .map(|i| {
            while (i as f64 + 0.5) * spacing > end && edge + 1 < edges.len() {
                edge += 1;
                end += edges[edge];
                direction += PI - angles[hem[edge]];
            }
            (edge, direction)
        })
        .collect();
    let whole_turn: f64 = hem.iter().map(|&v| PI - angles[v]).sum();
    let steps = smoothed_steps(&samples.iter().map(|s| s.1).collect::<Vec<_>>(), whole_turn, spacing);
    let piece = ((PIECE / spacing) as usize).clamp(1, count);
    let of_piece = |start: usize| (start..start + piece).map(|i| steps[i % count]).sum::<f64>();
    let shortest = (0..count).map(|i| (i, of_piece(i))).min_by(|a, b| a.1.total_cmp(&b.1))?.0;
    let at = point(samples[(shortest + piece / 2) % count].0);
    let length_per_smooth_length = length / steps.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    Some(RaggedHem { length_per_smooth_length, length, at, height: at.y - floor })
}

/// The lengths of the steps of a line in a plane after smoothing: each is the weighted mean of the steps around it, which are given
/// by their directions. The line goes on after its end as from its beginning, turned by `whole_turn`.
fn smoothed_steps(directions: &[f64], whole_turn: f64, spacing: f64) -> Vec<f64> {
    let (count, reach) = (directions.len() as isize, (REACH * DEVIATION / spacing).ceil() as isize);
    let weights: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 * spacing / DEVIATION).powi(2)).exp()).collect();
    let total: f64 = weights.iter().sum();
    let step = |i: isize| {
        let turned = directions[i.rem_euclid(count) as usize] + whole_turn * i.div_euclid(count) as f64;
        let (sin, cos) = turned.sin_cos();
        Vector2::new(cos, sin)
    };
    let smoothed = |i: isize| (-reach..=reach).zip(&weights).map(|(k, &w)| step(i + k) * w).sum::<Vector2<f64>>();
    (0..count).map(|i| smoothed(i).norm() / total * spacing).collect()
}
