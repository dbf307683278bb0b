//! The size of the person in a scan relative to the figure.

use super::layers::IndexedLayer;
use crate::geometry::{TriMesh, VertexId};
use nalgebra::{SMatrix, SVector};

/// Scan and figure within this distance are compared, in metres: another person of the same model is at most so far off.
const REACH: f64 = 0.06;
/// Points needed for a result.
const LEAST: usize = 200;

/// The scale s that minimises Σ area · (n · (s R (p − c) + t − q))², for small rotations R: p on the figure, q on the
/// scan, n the scan's normal, c their mean. 1 for the same person. `None` if too little of the figure is visible.
pub(super) fn relative_scale(
    scan: &TriMesh,
    visible: impl Iterator<Item = (VertexId, f64)>,
    layers: &[IndexedLayer],
) -> Option<f64> {
    let normals = scan.vertex_normals_by_area();
    let pairs: Vec<_> = visible
        .filter_map(|(v, area)| {
            let q = scan.points()[v];
            let closest = layers.iter().filter_map(|layer| layer.index.closest_within(&q, REACH));
            let p = closest.min_by(|a, b| a.distance.total_cmp(&b.distance))?.point;
            Some((p, q, normals[v], area))
        })
        .collect();
    if pairs.len() < LEAST {
        return None;
    }
    let total: f64 = pairs.iter().map(|pair| pair.3).sum();
    let middle = pairs.iter().map(|(p, _, _, area)| p.coords * *area).sum::<nalgebra::Vector3<f64>>() / total;
    let (mut matrix, mut right) = (SMatrix::<f64, 7, 7>::zeros(), SVector::<f64, 7>::zeros());
    for (p, q, n, area) in pairs {
        let arm = p.coords - middle;
        let turn = arm.cross(&n);
        let row = SVector::<f64, 7>::from([arm.dot(&n), turn.x, turn.y, turn.z, n.x, n.y, n.z]);
        matrix += row * row.transpose() * area;
        right += row * (n.dot(&(q - p)) * area);
    }
    Some(1.0 + matrix.lu().solve(&right)?[0])
}
