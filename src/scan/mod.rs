//! A mesh in; a cleaned [`Scan`], metres, Y up, out.

mod clean;
mod decimate;
mod error;
mod frame;
mod params;
mod pieces;
mod profile;
mod rgbd;
mod smooth;
#[cfg(test)]
mod tests;
mod upright;

pub use clean::clean;
pub use error::ScanError;
pub use frame::FileFrame;
pub use params::{ScanParams, Unit, Up};
pub use rgbd::{
    FramePose, Fusion, FusionError, FusionParams, FusionReport, FusionStep, RgbdCamera, SurfaceSoFar, fuse,
};

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

/// Progress of cleaning: a part of the work is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CleaningStep {
    /// What was done.
    pub name: &'static str,
    /// Vertices that there are now.
    pub vertices: usize,
    /// Faces that there are now.
    pub faces: usize,
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
