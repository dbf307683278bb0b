//! Closest points of a posed surface to points of the scan.

use super::sampling::spread;
use super::scan_surface::{LastFaces, ScanSurface};
use crate::fit::solver::{Residual, robust};
use crate::geometry::{PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId};
use rayon::prelude::*;

/// Point-to-plane residuals from sample points of the scan to the closest points of a posed mesh with these normals, if `takes`
/// accepts the corners of the closest face.
pub(crate) fn scan_to_mesh(
    surface: &ScanSurface,
    posed: &SurfaceIndex,
    normals: &PerVertex<Vec3>,
    samples: &[(VertexId, f64)],
    reach: f64,
    least_cosine: f64,
    takes: impl Fn(&[VertexId; 3]) -> bool + Sync,
) -> Vec<Residual> {
    let anew = LastFaces::none(samples.len());
    scan_to_mesh_from(surface, posed, normals, (samples, &anew), reach, least_cosine, takes)
}

/// [`scan_to_mesh`], where each search starts from the face that was closest last time.
pub(crate) fn scan_to_mesh_from(
    surface: &ScanSurface,
    posed: &SurfaceIndex,
    normals: &PerVertex<Vec3>,
    (samples, last): (&[(VertexId, f64)], &LastFaces),
    reach: f64,
    least_cosine: f64,
    takes: impl Fn(&[VertexId; 3]) -> bool + Sync,
) -> Vec<Residual> {
    samples
        .par_iter()
        .enumerate()
        .filter_map(|(k, &(v, area))| {
            let q = surface.mesh().points()[v];
            let normal = surface.normals[v];
            let s = posed.closest_within_from(&q, reach, last.of(k))?;
            last.remember(k, s.face);
            let corners = posed.mesh().faces()[s.face];
            let on_mesh: Vec3 = (0..3).map(|k| normals[corners[k]] * s.barycentric[k]).sum();
            if !takes(&corners) || on_mesh.dot(&normal) < least_cosine {
                return None;
            }
            let at = std::array::from_fn(|k| (corners[k], s.barycentric[k]));
            let gap = normal.dot(&(q - s.point));
            Some(Residual { at, normal, gap, weight: robust(area, s.distance, reach) })
        })
        .collect()
}

/// Point-to-plane residuals from sample points of a posed surface to the closest points of the scan, each search from the face that was
/// closest last time.
pub(crate) fn mesh_to_scan_from(
    surface: &ScanSurface,
    points: &PerVertex<Point>,
    normals: &PerVertex<Vec3>,
    (samples, last): (&[(VertexId, f64)], &LastFaces),
    reach: f64,
    least_cosine: f64,
) -> Vec<Residual> {
    samples
        .par_iter()
        .enumerate()
        .filter_map(|(k, &(v, area))| {
            let p = points[v];
            let hit = surface.nearest_from(&p, reach, last, k)?;
            if hit.at_rim || hit.normal.dot(&normals[v]) < least_cosine {
                return None;
            }
            let gap = hit.normal.dot(&(hit.point - p));
            let weight = hit.confidence * robust(area, hit.distance, reach);
            Some(Residual::on_vertex(v, hit.normal, gap, weight))
        })
        .collect()
}

/// Mean distance from a mesh, weighted by area and truncated to `truncate`.
pub(crate) fn mean_truncated(to: &SurfaceIndex, from: &TriMesh, areas: &PerVertex<f64>, truncate: f64) -> f64 {
    /// Sample points: enough for a mean to 1.5 %.
    const SAMPLES: usize = 1000;
    let samples = spread(areas, SAMPLES);
    let distances: Vec<(f64, f64)> = samples
        .iter()
        .map(|&(v, a)| (a, to.closest_within(&from.points()[v], truncate).map_or(truncate, |s| s.distance)))
        .collect();
    let total: f64 = distances.iter().map(|d| d.0).sum();
    distances.iter().map(|d| d.0 * d.1).sum::<f64>() / total.max(1e-12)
}
