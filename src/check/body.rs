//! Whether the naked scan shows a bare person who stands upright.

use super::error::CheckError;
use super::statistics::weighted_quantile;
use crate::body::{HumanJoint, Pose, Shape, Skeleton};
use crate::geometry::{SurfaceIndex, TriMesh};
use crate::scan::Scan;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What is known of the body's step.
pub struct BodyResult<'a> {
    /// The naked scan.
    pub scan: &'a Scan,
    /// The model's surface as fitted, posed in the scan.
    pub fitted: &'a TriMesh,
    /// The registered surface, posed in the scan; it has the faces of `fitted`.
    pub registered: &'a TriMesh,
    /// The skeleton of the registered body.
    pub skeleton: &'a Skeleton,
    /// Its pose in the scan.
    pub pose: &'a Pose,
    /// β. **Shapes** one coefficient per component of the model.
    pub shape: &'a Shape,
}

/// What the body's step looks like. Lengths are metres, angles radians.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyPlausibility {
    /// Angle between the trunk, from hips to head, and the vertical; `None` for a skeleton without these joints.
    pub tilt: Option<f64>,
    /// Median of how far registration moved the fitted surface, along its normal.
    pub moved_median: Option<f64>,
    /// 95th percentile of the absolute move.
    pub moved_p95: Option<f64>,
    /// Median of the move with its sign: outward is positive.
    pub moved_outward: Option<f64>,
    /// 90th percentile of the angle between the normals of the scan and those of the fitted surface.
    pub bent_p90: Option<f64>,
    /// Median of that angle.
    pub bent_median: Option<f64>,
    /// 95th percentile of the scan's distance from the fitted surface.
    pub fitted_p95: Option<f64>,
    /// Greatest absolute coefficient of the shape, in standard deviations.
    pub deviation: f64,
    /// Root mean square of the coefficients of the shape, in standard deviations.
    pub deviation_rms: f64,
}

/// Measures how plausible the body's step is.
///
/// **Errors** if the registered surface has another size than the fitted one.
pub fn check_body(result: &BodyResult) -> Result<BodyPlausibility, CheckError> {
    let BodyResult { scan, fitted, registered, skeleton, pose, shape } = result;
    CheckError::require_length("registered surface", registered.vertex_count(), fitted.vertex_count())?;
    let joints = skeleton.joints_in_world(pose);
    let place = |joint| skeleton.find(joint).map(|j| joints[j.index()]);
    let trunk = place(HumanJoint::Hips).zip(place(HumanJoint::Head)).map(|(hips, head)| head - hips);
    let (areas, normals) = (fitted.vertex_areas(), fitted.vertex_normals_by_area());
    let moves: Vec<(f64, f64)> = fitted
        .vertex_ids()
        .map(|v| ((registered.points()[v] - fitted.points()[v]).dot(&normals[v]), areas[v]))
        .collect();
    let absolute: Vec<(f64, f64)> = moves.iter().map(|(m, area)| (m.abs(), *area)).collect();
    let index = SurfaceIndex::prepare(fitted);
    let (scan_areas, scan_normals) = (scan.mesh.vertex_areas(), scan.mesh.vertex_normals_by_area());
    let on_scan: Vec<(f64, f64, f64)> = scan
        .mesh
        .vertex_ids()
        .collect::<Vec<_>>()
        .par_iter()
        .map(|&v| {
            let at = index.closest(&scan.mesh.points()[v]);
            (at.distance, scan_normals[v].angle(&fitted.face_normal(at.face)), scan_areas[v])
        })
        .collect();
    let bends: Vec<(f64, f64)> = on_scan.iter().map(|s| (s.1, s.2)).collect();
    let count = shape.0.len().max(1) as f64;
    Ok(BodyPlausibility {
        tilt: trunk.map(|trunk| trunk.angle(&nalgebra::Vector3::y())),
        moved_median: weighted_quantile(absolute.clone(), 0.5),
        moved_p95: weighted_quantile(absolute, 0.95),
        moved_outward: weighted_quantile(moves, 0.5),
        bent_p90: weighted_quantile(bends.clone(), 0.9),
        bent_median: weighted_quantile(bends, 0.5),
        fitted_p95: weighted_quantile(on_scan.iter().map(|s| (s.0, s.2)).collect(), 0.95),
        deviation: shape.0.iter().fold(0.0_f64, |most, beta| most.max(beta.abs())),
        deviation_rms: (shape.0.iter().map(|beta| beta * beta).sum::<f64>() / count).sqrt(),
    })
}
