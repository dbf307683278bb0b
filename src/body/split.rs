//! Duplicates the vertices on texture seams: glTF and graphics cards have one texture coordinate per vertex.

use super::uv::UvMap;
use crate::geometry::{PerFace, PerVertex, TriMesh, VertexId};
use std::collections::BTreeMap;

/// A mesh's vertices, with those on seams duplicated.
pub struct Split {
    /// The mesh's vertex of each; the originals come first, in their order.
    pub vertices: Vec<VertexId>,
    /// F × 3, into `vertices`.
    pub faces: Vec<[u32; 3]>,
    /// Texture coordinates of each, from the upper left as in glTF; empty if the mesh has none.
    pub uvs: Vec<[f32; 2]>,
}

impl Split {
    /// Without texture coordinates nothing is duplicated.
    pub fn along_seams(mesh: &TriMesh, uvs: Option<&UvMap>) -> Self {
        let mut vertices: Vec<VertexId> = mesh.vertex_ids().collect();
        let Some(uvs) = uvs else {
            return Self { vertices, faces: mesh.faces().iter().map(|f| f.map(|v| v.0)).collect(), uvs: Vec::new() };
        };
        let place = |c: u32| {
            let [u, v] = uvs.coords[c as usize];
            [u as f32, (1.0 - v) as f32]
        };
        let mut coords: Vec<Option<u32>> = vec![None; vertices.len()];
        let mut doubles: BTreeMap<(VertexId, u32), u32> = BTreeMap::new();
        let mut faces = Vec::with_capacity(mesh.face_count());
        for (face, corners) in mesh.faces().iter().zip(uvs.corners.iter()) {
            faces.push(std::array::from_fn(|k| {
                let (v, c) = (face[k], corners[k]);
                match coords[v.index()] {
                    None => {
                        coords[v.index()] = Some(c);
                        v.0
                    }
                    Some(own) if own == c => v.0,
                    Some(_) => *doubles.entry((v, c)).or_insert_with(|| {
                        vertices.push(v);
                        coords.push(Some(c));
                        vertices.len() as u32 - 1
                    }),
                }
            }));
        }
        let uvs = coords.into_iter().map(|c| c.map_or([0.0, 0.0], place)).collect();
        Self { vertices, faces, uvs }
    }

    /// The values of a vertex's first corner, `[1, 0, 0, 1]` for one without faces: those of its other corners are equal where
    /// texture coordinates go on.
    ///
    /// **Shapes** `corners` F × 3.
    pub fn of_corners(&self, corners: &PerFace<[[f32; 4]; 3]>) -> Vec<[f32; 4]> {
        let mut values: Vec<Option<[f32; 4]>> = vec![None; self.vertices.len()];
        for (face, of_face) in self.faces.iter().zip(corners.iter()) {
            for (v, value) in face.iter().zip(of_face) {
                values[*v as usize].get_or_insert(*value);
            }
        }
        values.into_iter().map(|value| value.unwrap_or([1.0, 0.0, 0.0, 1.0])).collect()
    }

    /// The mesh's value of each vertex.
    pub fn spread<'a, T>(&'a self, values: &'a PerVertex<T>) -> impl Iterator<Item = &'a T> {
        self.vertices.iter().map(|v| &values[*v])
    }
}
