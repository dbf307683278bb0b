//! Tangents of a surface with texture coordinates, as all programs compute them.

use crate::body::UvMap;
use crate::geometry::{PerFace, PerVertex, TriMesh, Vec3};
use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};

/// Per face the tangents of its corners: direction in which the first texture coordinate grows, and the sign of the bitangent,
/// along which the second one grows upwards.
///
/// **Shapes** `F × 3`, each x, y, z and 1 or −1.
///
/// **Requires** `uvs` that fit.
///
/// **Source** MikkTSpace, with the surface's vertex normals.
pub fn tangents(surface: &TriMesh, uvs: &UvMap) -> PerFace<[[f32; 4]; 3]> {
    let normals = surface.vertex_normals();
    let unknown = PerFace::filled([[1.0, 0.0, 0.0, 1.0]; 3], surface.face_count());
    let mut corners = Corners { surface, normals: &normals, uvs, tangents: unknown };
    // Triangles are all that it can take, so nothing can fail; faces without area keep what they have.
    _ = generate_tangents(&mut corners);
    corners.tangents
}

struct Corners<'a> {
    surface: &'a TriMesh,
    normals: &'a PerVertex<Vec3>,
    uvs: &'a UvMap,
    tangents: PerFace<[[f32; 4]; 3]>,
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.surface.face_count()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.surface.points()[self.surface.faces().0[face][corner]].coords.map(|c| c as f32).into()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.normals[self.surface.faces().0[face][corner]].map(|c| c as f32).into()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.uvs.coords[self.uvs.corners.0[face][corner] as usize].map(|c| c as f32)
    }

    fn set_tangent(&mut self, tangent: Option<TangentSpace>, face: usize, corner: usize) {
        let Some(found) = tangent.map(|tangent| tangent.tangent_encoded()) else { return };
        let length = found[..3].iter().map(|c| c * c).sum::<f32>().sqrt();
        if length > 0.5 {
            let [x, y, z, sign] = found;
            self.tangents.0[face][corner] = [x / length, y / length, z / length, sign];
        }
    }
}
