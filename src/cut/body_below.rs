//! The body that a garment is worn on.

use crate::geometry::{PerVertex, TriMesh};

/// The body below a garment, posed in its scan.
///
/// **Shapes** `covered`: one entry per vertex of `mesh`.
#[derive(Clone, Copy, Debug)]
pub struct BodyBelow<'a> {
    /// Its surface.
    pub mesh: &'a TriMesh,
    /// Which vertices the garment's template covers.
    pub covered: &'a PerVertex<bool>,
    /// Whether the garment goes between the legs, as trousers do and shirts do not.
    pub goes_between_legs: bool,
}
