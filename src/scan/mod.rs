//! Mesh or RGB-D frames -> a cleaned [`Scan`] in metres, Y up.

mod base;
mod clean;
mod counted;
mod decimate;
mod error;
mod frame;
mod noise;
mod params;
mod pieces;
mod profile;
mod reduce;
mod remesh;
#[cfg(test)]
mod repair_tests;
mod rgbd;
mod seams;
mod shells;
mod smooth;
#[cfg(test)]
mod tests;
mod texture;
mod upright;

pub use clean::clean;
pub use error::ScanError;
pub use frame::FileFrame;
pub use params::{ScanParams, Unit, Up};
pub use remesh::Remesh;
pub use rgbd::{
    FramePose, Fusion, FusionError, FusionParams, FusionReport, FusionStep, Photograph, RgbdCamera, SurfaceSoFar, fuse,
    photographs,
};
pub use texture::{PictureSampler, TextureReport, color_from_texture};

use crate::geometry::{PerFace, PerVertex, TriMesh};
use serde::{Deserialize, Serialize};

/// A cleaned scan in the world frame: metres, Y up; position and heading are those of the file.
///
/// **Shapes** `colors`, `confidence` and `file_vertices`: one entry per vertex of `mesh`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scan {
    /// The surface, oriented outward.
    pub mesh: TriMesh,
    /// Colours as scanned.
    pub colors: Option<PerVertex<[u8; 3]>>,
    /// Confidence of each vertex, 0 to 1, if the file or the fusion provides it.
    pub confidence: Option<PerVertex<f32>>,
    /// Index of each vertex in the file; cleaning drops and moves vertices and adds none; of quads, the nearest one.
    pub file_vertices: PerVertex<u32>,
    /// Transform from the file's coordinates.
    pub world_from_file: FileFrame,
    /// Assumptions and repairs, one sentence each.
    pub findings: Vec<String>,
}

/// Progress of cleaning: one part of the work is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CleaningStep {
    /// The part.
    pub name: &'static str,
    /// Vertices of the mesh now.
    pub vertices: usize,
    /// Faces of the mesh now.
    pub faces: usize,
}

impl Scan {
    /// The scan with some of its faces, and the vertices that they use.
    ///
    /// **Shapes** `keep`: one entry per face.
    ///
    /// # Panics
    /// If `keep` has another length.
    pub fn part(&self, keep: &PerFace<bool>) -> Self {
        let (mesh, from) = self.mesh.part(keep);
        Self {
            mesh,
            colors: self.colors.as_ref().map(|colors| from.iter().map(|&v| colors[v]).collect()),
            confidence: self.confidence.as_ref().map(|confidence| from.iter().map(|&v| confidence[v]).collect()),
            file_vertices: from.iter().map(|&v| self.file_vertices[v]).collect(),
            world_from_file: self.world_from_file,
            findings: self.findings.clone(),
        }
    }

    /// A scan from a clean mesh in the world frame.
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
