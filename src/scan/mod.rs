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
    /// How the file's coordinates became ours.
    pub world_from_file: FileFrame,
    /// What was assumed and mended, a sentence each.
    pub findings: Vec<String>,
}
