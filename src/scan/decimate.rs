//! Decimation.

use crate::geometry::{PerFace, PerVertex, Point, TriMesh, VertexId};
use meshopt::{SimplifyOptions, VertexDataAdapter};

/// The mesh with about `faces` faces, and per vertex the vertex of `mesh` that it was: quadric edge collapse, which keeps
/// positions. `None` if there is nothing to remove.
///
/// Borders may move along themselves, but have weight in the quadrics, so holes keep their outline.
pub(super) fn decimated(mesh: &TriMesh, faces: usize) -> Option<(TriMesh, PerVertex<VertexId>)> {
    // A few percent do not justify a new mesh.
    if mesh.face_count() <= faces.saturating_add(faces / 50) {
        return None;
    }
    // Internally f32: relative to the centre its rounding is far below a micrometre.
    let center = mesh.bounds().map_or_else(Point::origin, |b| b.center());
    let positions: Vec<[f32; 3]> = mesh
        .points()
        .iter()
        .map(|p| {
            let d = p - center;
            [d.x as f32, d.y as f32, d.z as f32]
        })
        .collect();
    let vertices = VertexDataAdapter::new(bytemuck::cast_slice(&positions), size_of::<[f32; 3]>(), 0)
        .expect("the bytes are whole rows of three f32");
    let indices: Vec<u32> = mesh.faces().iter().flatten().map(|v| v.0).collect();
    // The error is unlimited: the face count decides.
    let fewer = meshopt::simplify(&indices, &vertices, faces * 3, 1.0, SimplifyOptions::RegularizeLight, None);
    let faces: Vec<[VertexId; 3]> = fewer.chunks_exact(3).map(|c| [c[0], c[1], c[2]].map(VertexId)).collect();
    let all = PerFace::filled(true, faces.len());
    let fewer = mesh.with_faces(faces);
    Some(fewer.part(&all))
}
