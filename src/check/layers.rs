//! Distances and colours of scan and layers.

use crate::geometry::{PerVertex, SurfaceIndex, SurfacePoint};
use crate::segment::{Inner, Lab, color_difference, lab_of};

/// One surface of the figure so far, ready to be asked for its closest point.
pub(super) struct IndexedLayer<'a> {
    pub(super) index: SurfaceIndex,
    pub(super) colors: Option<&'a PerVertex<[u8; 3]>>,
}

impl<'a> IndexedLayer<'a> {
    pub(super) fn of(layer: &Inner<'a>) -> Self {
        Self { index: SurfaceIndex::prepare(layer.mesh), colors: layer.colors }
    }

    /// The colour at a point of the surface.
    pub(super) fn color_at(&self, at: &SurfacePoint) -> Option<Lab> {
        let corner = at.nearest_corner(self.index.mesh());
        self.colors.map(|colors| lab_of(colors[corner]))
    }
}

/// How differently two places are coloured, in spreads of one cloth between two views.
pub(super) fn difference(a: Option<Lab>, b: Option<Lab>) -> Option<f64> {
    Some(color_difference(&a?, &b?))
}
