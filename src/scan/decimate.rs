//! Decimation.

use crate::geometry::{PerVertex, Point, TriMesh, TriangleShapes, VertexId, simplified};

/// The mesh with about `faces` faces, and per vertex the vertex of `mesh` that it was. `None` if there is nothing to
/// remove.
pub(super) fn decimated(mesh: &TriMesh, faces: usize) -> Option<(TriMesh, PerVertex<VertexId>)> {
    // A few percent do not justify a new mesh.
    if mesh.face_count() <= faces.saturating_add(faces / 50) {
        return None;
    }
    // Internally f32: relative to the centre its rounding is far below a micrometre.
    let center = mesh.bounds().map_or_else(Point::origin, |b| b.center());
    Some(simplified(mesh, &center, faces, TriangleShapes::Regular))
}
