//! A figure as a file holds it.

use super::{Figure, Layer, PoseDirs, Skeleton};
use serde::Deserialize;
use std::sync::Arc;

/// A figure read from a file: its surfaces lack the corrective offsets of the body model, which are many times as large as
/// everything else and belong to the model. A [`Figure`] itself cannot be read, so none is posed without its offsets.
#[derive(Clone, Debug, Deserialize)]
pub struct StoredFigure {
    skeleton: Skeleton,
    layers: Vec<Layer>,
}

impl StoredFigure {
    /// Whether a surface follows corrective offsets.
    pub fn needs_offsets(&self) -> bool {
        self.layers.iter().any(|layer| layer.weights.has_pose_offsets())
    }

    /// The figure with the offsets of its body model; `None` where it needs them and there are none.
    pub fn with_offsets(self, dirs: Option<&Arc<PoseDirs>>) -> Option<Figure> {
        let is_incomplete = self.needs_offsets() && dirs.is_none();
        let Self { skeleton, mut layers } = self;
        if let Some(dirs) = dirs {
            layers.iter_mut().for_each(|layer| layer.weights.restore_pose_dirs(dirs));
        }
        (!is_incomplete).then_some(Figure { skeleton, layers })
    }
}
