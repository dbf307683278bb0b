//! How far an estimated body may be off, place by place.

use super::contact::zones;
use crate::body::BodyModel;
use crate::fit::naked::FittedBody;
use crate::geometry::{PerVertex, TriMesh, Vec3, VertexId};
use nalgebra::{DMatrix, RowDVector};
use std::collections::BTreeMap;

/// Half an interval of 90 % of a normal distribution, in standard deviations.
pub const HALF_INTERVAL_90: f64 = 1.645;

/// The standard deviation of each vertex along its normal: what β leaves open, and `beyond`, which the model does not express.
///
/// **Shapes** `covariance` of β, K × K; one entry per vertex of the surface.
pub(super) fn along_normals(
    model: &BodyModel,
    surface: &TriMesh,
    covariance: &DMatrix<f64>,
    beyond: f64,
) -> PerVertex<f64> {
    let of_vertex = |(v, normal): (VertexId, &Vec3)| {
        let along = model.shape_dirs.iter().map(|dirs| dirs[v].dot(normal));
        let row = RowDVector::from_iterator(model.component_count(), along);
        let variance = (&row * covariance * row.transpose())[(0, 0)];
        variance.max(0.0).sqrt().hypot(beyond)
    };
    surface.vertex_normals_by_area().enumerate().map(of_vertex).collect()
}

/// The mean deviation of each part of an estimated body, in metres; `None` for a body that was scanned bare.
pub fn deviation_by_part(fitted: &FittedBody, model: &BodyModel) -> Option<BTreeMap<String, f64>> {
    let deviation = fitted.deviation.as_ref()?;
    let areas = fitted.surface.vertex_areas();
    let mut sums: BTreeMap<String, (f64, f64)> = BTreeMap::new();
    for (v, zone) in zones(model).enumerate() {
        let part = zone.split('.').next().unwrap_or(zone);
        let (sum, total) = sums.entry(part.to_string()).or_default();
        *sum += areas[v] * deviation[v];
        *total += areas[v];
    }
    Some(sums.into_iter().map(|(part, (sum, total))| (part, sum / total)).collect())
}
