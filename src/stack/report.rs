//! What stacking reports.

use serde::{Deserialize, Serialize};

/// What stacking did with respect to one inner layer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LayerReport {
    /// The inner layer.
    pub layer: String,
    /// Garment vertices inside it, before.
    pub inside_before: usize,
    /// Garment vertices inside it, after.
    pub inside_after: usize,
    /// Pairs of triangles that cross, before.
    pub intersecting_pairs_before: usize,
    /// Pairs of triangles that cross, after.
    pub intersecting_pairs_after: usize,
}

/// What stacking did. Lengths are metres.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StackReport {
    /// One entry per inner layer, innermost first.
    pub layers: Vec<LayerReport>,
    /// Vertices of any garment inside a layer further in, after stacking.
    pub inside: usize,
    /// Pairs of triangles that cross after stacking, in all layers: of two layers, or of one.
    pub crossing_pairs: usize,
    /// Mean move of all vertices.
    pub mean_move: f64,
    /// Greatest move.
    pub max_move: f64,
    /// Mean move of the vertices that already had the clearance from every layer.
    pub mean_move_of_clear: f64,
    /// Rounds spent on separating crossing triangles.
    pub rounds: usize,
}
