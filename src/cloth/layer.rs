//! A layer of cloth.

use super::fabric::Fabric;
use crate::geometry::{PerVertex, TriMesh};

/// A layer of cloth: its rest shape and which vertices are held.
///
/// **Shapes** `pinned` has one entry per vertex of `rest`.
#[derive(Clone, Debug)]
pub struct ClothLayer {
    /// The rest lengths are those of this mesh.
    pub rest: TriMesh,
    /// Vertices that stay at their initial positions, as under an elastic waistband.
    pub pinned: PerVertex<bool>,
    /// What it is made of.
    pub fabric: Fabric,
}
