//! Surfaces of a figure in the pose of a step.

use crate::body::Figure;
use crate::fit::PoseInside;
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::session::error::SessionError;

/// All surfaces of `figure` inside a scan, in the frame of the scan; the body with its offsets comes first.
pub(in crate::session) fn surfaces_inside(figure: &Figure, inside: &PoseInside) -> Result<Vec<TriMesh>, SessionError> {
    let mut surfaces = figure.posed(&inside.pose);
    if let Some(body) = surfaces.first_mut() {
        *body = along_normals(body, &inside.offsets)?;
    }
    Ok(surfaces)
}

/// The body of `figure` with its offsets inside a scan, in the frame of the scan.
pub(in crate::session::pipeline) fn body_inside(figure: &Figure, inside: &PoseInside) -> Result<TriMesh, SessionError> {
    along_normals(&figure.body().posed(&figure.skeleton, &inside.pose), &inside.offsets)
}

/// The body moved along its normals by the offsets of a step's pose.
pub(in crate::session) fn along_normals(posed: &TriMesh, offsets: &PerVertex<f64>) -> Result<TriMesh, SessionError> {
    if offsets.len() != posed.vertex_count() {
        let (offsets, vertices) = (offsets.len(), posed.vertex_count());
        return Err(SessionError::Internal { what: format!("{offsets} offsets for a body of {vertices} vertices") });
    }
    let normals = posed.vertex_normals();
    let points = posed.points().iter().zip(normals.iter()).zip(offsets.iter());
    let moved: PerVertex<Point> = points.map(|((p, n), d)| p + n * *d).collect();
    Ok(posed.with_points(moved))
}
