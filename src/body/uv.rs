//! Texture coordinates with seams.

use crate::geometry::{PerFace, PerVertex, TriMesh};
use serde::{Deserialize, Serialize};

/// A texture coordinate for each corner of each face; neighbours share one, but across a seam.
///
/// **Shapes** `coords` `T × 2`, from the lower left of the picture, 0–1; `corners` `F × 3`, into `coords`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct UvMap {
    /// The places on the picture.
    pub coords: Vec<[f64; 2]>,
    /// For each face the places of its corners.
    pub corners: PerFace<[u32; 3]>,
    /// The picture, where there is one.
    pub texture: Option<Texture>,
}

/// A picture to be wrapped around a surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Texture {
    /// Pixels along a side.
    pub side: usize,
    /// sRGB, rows from the top.
    pub pixels: Vec<[u8; 3]>,
}

impl UvMap {
    /// One place a vertex: no seam.
    pub fn per_vertex(mesh: &TriMesh, coords: PerVertex<[f64; 2]>) -> Self {
        Self { coords: coords.0, corners: mesh.faces().iter().map(|f| f.map(|v| v.0)).collect(), texture: None }
    }

    /// Whether it belongs to a mesh of so many faces and every corner has a place.
    pub fn fits(&self, mesh: &TriMesh) -> bool {
        self.corners.len() == mesh.face_count()
            && self.corners.iter().flatten().all(|&c| (c as usize) < self.coords.len())
    }

    /// The corners of a face on the picture.
    pub fn triangle(&self, face: usize) -> [[f64; 2]; 3] {
        self.corners.0[face].map(|c| self.coords[c as usize])
    }
}
