//! A mesh in; a cleaned [`Scan`], metres, Y up, out.

mod frame;

pub use frame::FileFrame;

use crate::geometry::{PerVertex, TriMesh};
use serde::{Deserialize, Serialize};

/// A cleaned scan in the world frame: metres, Y up; place and heading are those of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// The surface, oriented outward.
    pub mesh: TriMesh,
    /// Colours as scanned.
    pub colors: Option<PerVertex<[u8; 3]>>,
    /// How well each vertex was seen, 0 to 1, where the file or a fusion says so.
    pub confidence: Option<PerVertex<f32>>,
    /// Which vertex of the file each vertex was; vertices are dropped and smoothed, never made.
    pub file_vertices: PerVertex<u32>,
    /// How the file's coordinates became ours.
    pub world_from_file: FileFrame,
    /// What was assumed and mended, a sentence each.
    pub findings: Vec<String>,
}

impl Scan {
    /// A mesh that is clean already, in the world frame.
    pub fn from_clean_mesh(mesh: TriMesh, colors: Option<PerVertex<[u8; 3]>>) -> Self {
        Self {
            file_vertices: (0..mesh.vertex_count() as u32).collect(),
            mesh,
            colors,
            confidence: None,
            world_from_file: FileFrame::identity(),
            findings: Vec::new(),
        }
    }
}
