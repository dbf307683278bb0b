//! Distances between two surfaces and between two sets of joints, and skin outside a scan.

use super::error::MeasureError;
use super::sample::{SAMPLE_COUNT, area_weighted, distances, mean, percentile};
use super::truth::{JointPositions, STRICT_JOINTS};
use crate::geometry::{Adjacency, PerVertex, SurfaceIndex, TriMesh, WindingField};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Distance between two surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceDistance {
    /// Mean distance from samples of one surface to the nearest point of the other, and the reverse: the larger mean.
    pub surface_mean_mm: f64,
    /// The larger 95th percentile.
    pub surface_p95_mm: f64,
}

/// The distance in both directions, of which the larger counts: a missing arm is as wrong as a third one.
pub fn surface_distance(result: &TriMesh, truth: &TriMesh) -> SurfaceDistance {
    let there = distances(truth, &SurfaceIndex::prepare(result));
    let back = distances(result, &SurfaceIndex::prepare(truth));
    SurfaceDistance {
        surface_mean_mm: 1e3 * mean(&there).max(mean(&back)),
        surface_p95_mm: 1e3 * percentile(&there, 0.95).max(percentile(&back, 0.95)),
    }
}

/// Mean distance over [`STRICT_JOINTS`], in millimetres; joints missing on either side are left out; `None` if
/// they have no joint in common.
pub fn joint_mean_mm(result: &JointPositions, truth: &JointPositions) -> Option<f64> {
    let apart: Vec<f64> =
        STRICT_JOINTS.iter().filter_map(|joint| Some((result.get(joint)? - truth.get(joint)?).norm())).collect();
    (!apart.is_empty()).then(|| 1e3 * mean(&apart))
}

/// Share (0–1) of covered skin that is outside the scan by more than `margin` metres, of all covered skin that the scan
/// observed well; `None` if it observed none, for then nothing is certified.
///
/// **Shapes** `covered` has one entry per vertex of `body`.
///
/// Observed well: the closest point of the scan lies in a face without a boundary vertex that faces the way the skin does.
/// Where the scan has a hole nothing can be certified; and a face turned away from the skin (a membrane that fusion left
/// between an open front and what is worn below) is no observation of what lies over it.
///
/// Outside: by the side of the closest point *and* by the winding number. Beside the edge of an open front, where thin
/// cloth folds over, the closest point belongs to the fold's far side and gives the wrong sign on its own.
///
/// **Errors** [`MeasureError::WrongLength`].
pub fn outside_scan(
    body: &TriMesh,
    covered: &PerVertex<bool>,
    scan: &TriMesh,
    margin: f64,
) -> Result<Option<f64>, MeasureError> {
    MeasureError::check_length("cover flags", covered.len(), body.vertex_count())?;
    let index = SurfaceIndex::prepare(scan);
    let winding = WindingField::prepare(scan);
    let on_boundary = Adjacency::prepare(scan).boundary_vertices();
    let is_outside: Vec<Option<bool>> = area_weighted(body, SAMPLE_COUNT)
        .par_iter()
        .filter(|s| body.faces()[s.face].iter().all(|&v| covered[v]))
        .map(|s| {
            let (closest, side) = index.closest_signed(&s.point);
            let observed_well = closest.distance.is_finite()
                && !scan.faces()[closest.face].iter().any(|&v| on_boundary[v])
                && scan.face_normal(closest.face).dot(&body.face_normal(s.face)) > 0.0;
            observed_well.then(|| side > 0.0 && closest.distance > margin && !winding.is_inside(&s.point))
        })
        .collect();
    let seen = is_outside.iter().flatten().count();
    let outside = is_outside.iter().flatten().filter(|&&o| o).count();
    Ok((seen > 0).then(|| outside as f64 / seen as f64))
}
