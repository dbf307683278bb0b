//! All surfaces that may touch, joined into one mesh.

use crate::geometry::{Point, TriMesh};
use std::collections::BTreeMap;
use std::ops::Range;

/// The body and all layers of cloth as one mesh, with its edges.
///
/// **Shapes** `rest` V × 3, `faces` F × 3, `edges` E × 2, `sides` F × 3 (edges of a face), `owned` F.
pub(in crate::cloth) struct Surfaces {
    /// Positions in the bind pose.
    pub rest: Vec<Point>,
    pub faces: Vec<[u32; 3]>,
    pub edges: Vec<[u32; 2]>,
    pub sides: Vec<[u32; 3]>,
    /// Bits 0 to 2: the corners that this face stands for; bits 3 to 5: its sides. Each vertex and each edge has one such
    /// face, so that a pair of primitives is found once.
    pub owned: Vec<u8>,
    /// The vertices of each layer.
    pub vertices: Vec<Range<usize>>,
    /// The first layers are no cloth: the body, and what it wears already.
    pub solids: usize,
    /// Pairs of the first so many faces are not looked for.
    pub unpaired_faces: u32,
}

impl Surfaces {
    /// Joins the meshes, the body first.
    pub fn of(meshes: &[&TriMesh]) -> Self {
        let (mut rest, mut faces, mut vertices) = (Vec::new(), Vec::new(), Vec::new());
        for mesh in meshes {
            let first = rest.len();
            rest.extend(mesh.points().iter().copied());
            faces.extend(mesh.faces().iter().map(|corners| corners.map(|v| v.0 + first as u32)));
            vertices.push(first..rest.len());
        }
        let (mut edges, mut sides, mut owned) = (Vec::new(), Vec::new(), Vec::new());
        let mut index: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let mut seen = vec![false; rest.len()];
        for corners in &faces {
            let (mut own, mut of_face) = (0, [0; 3]);
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                if !std::mem::replace(&mut seen[a as usize], true) {
                    own |= 1 << k;
                }
                let edge = [a.min(b), a.max(b)];
                of_face[k] = *index.entry(edge).or_insert_with(|| {
                    own |= 8 << k;
                    edges.push(edge);
                    edges.len() as u32 - 1
                });
            }
            sides.push(of_face);
            owned.push(own);
        }
        Self { rest, faces, edges, sides, owned, vertices, solids: 1, unpaired_faces: 0 }
    }

    /// Joins the meshes, the first `solids` of which move as they are told, also through one another.
    pub fn around_solids(meshes: &[&TriMesh], solids: usize) -> Self {
        let unpaired_faces = meshes[..solids].iter().map(|mesh| mesh.face_count() as u32).sum();
        Self { solids, unpaired_faces, ..Self::of(meshes) }
    }

    /// The vertices of cloth, layer by layer.
    pub fn cloth(&self) -> &[Range<usize>] {
        self.vertices.get(self.solids..).unwrap_or_default()
    }

    /// The number of vertices of the body, or of all solids, which come first.
    pub fn body_vertices(&self) -> usize {
        self.vertices[..self.solids.min(self.vertices.len())].last().map_or(0, |last| last.end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::sphere;

    #[test]
    fn each_vertex_and_edge_has_one_face_that_stands_for_it() {
        let ball = sphere(6, 9);
        let surfaces = Surfaces::of(&[&ball, &ball]);
        assert_eq!(surfaces.body_vertices(), ball.vertex_count());
        let (mut vertices, mut edges) = (vec![0; surfaces.rest.len()], vec![0; surfaces.edges.len()]);
        for (f, own) in surfaces.owned.iter().enumerate() {
            for k in 0..3 {
                vertices[surfaces.faces[f][k] as usize] += i32::from(own >> k & 1);
                edges[surfaces.sides[f][k] as usize] += i32::from(own >> (3 + k) & 1);
            }
        }
        assert!(vertices.iter().chain(&edges).all(|&count| count == 1));
        // Euler: a closed surface of genus 0, twice.
        assert_eq!(surfaces.rest.len() + surfaces.faces.len(), surfaces.edges.len() + 4);
    }
}
