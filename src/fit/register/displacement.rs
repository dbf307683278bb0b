//! The smooth displacement of a surface toward targets.

use super::targets::TargetPoint;
use crate::fit::error::FitError;
use crate::geometry::{PerVertex, Point, TriMesh, Vec3, cotangent_laplacian};
use crate::numerics::SparseCholesky;

/// Minimises `Σ area · weight |x + d − target|² + length² dᵀLd` over the displacement `d` from `start`.
///
/// **Shapes** one target per vertex of `start`.
pub(crate) fn solve(start: &TriMesh, targets: &[TargetPoint], length: f64) -> Result<TriMesh, FitError> {
    /// Weight of zero displacement, against 1 for a target: only determines islands without targets.
    const REST_WEIGHT: f64 = 2e-3;
    let laplacian = cotangent_laplacian(start);
    let mut triplets: Vec<(usize, usize, f64)> =
        laplacian.triplets.iter().map(|&(r, c, v)| (r, c, v * length * length)).collect();
    let mut right = vec![Vec3::zeros(); targets.len()];
    for (i, target) in targets.iter().enumerate() {
        let area = laplacian.mass.0[i].max(1e-9);
        match target {
            Some((point, pull)) => {
                triplets.push((i, i, area * (pull + REST_WEIGHT)));
                right[i] = (point - start.points().0[i]) * (area * pull);
            }
            None => triplets.push((i, i, area * REST_WEIGHT)),
        }
    }
    let factor =
        SparseCholesky::prepare(targets.len(), &triplets).map_err(|e| FitError::Singular { reason: e.to_string() })?;
    let displacement = factor.solve_vectors(&right);
    Ok(start.with_points(start.points().iter().zip(&displacement).map(|(p, d)| p + d).collect::<PerVertex<Point>>()))
}

/// Weighted mean distance of the vertices from their targets.
pub(crate) fn mean_distance(mesh: &TriMesh, targets: &[TargetPoint]) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for (p, (target, pull)) in mesh.points().iter().zip(targets).filter_map(|(p, t)| Some((p, t.as_ref()?))) {
        sum += pull * (p - target).norm();
        total += pull;
    }
    sum / f64::max(total, 1e-12)
}

pub(crate) fn greatest_move(a: &TriMesh, b: &TriMesh) -> f64 {
    a.points().iter().zip(b.points().iter()).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max)
}

/// Root mean square move of the vertices, by area, in metres.
pub(crate) fn rms_move(a: &TriMesh, b: &TriMesh, areas: &PerVertex<f64>) -> f64 {
    let moves = a.points().iter().zip(b.points().iter()).map(|(p, q)| (p - q).norm_squared());
    let sum: f64 = moves.zip(areas.iter()).map(|(square, area)| square * area).sum();
    (sum / areas.iter().sum::<f64>().max(1e-12)).sqrt()
}
