//! Covered parts of a figure's layers, to be marked or removed in an export.

use super::error::ExportError;
use super::visible_part::{VisiblePart, visible_part};
use crate::body::{Figure, Layer};
use crate::geometry::{PerVertex, TriMesh, VertexId};

/// What an export removed of a layer.
#[derive(Clone, Debug, PartialEq)]
pub struct RemovedPart {
    /// The layer's name.
    pub layer: String,
    /// Surface of the whole layer in the bind pose, in m².
    pub area: f64,
    /// Surface of what was removed, in m².
    pub removed_area: f64,
    /// Whether all of the layer is covered; it then stays whole.
    pub is_all_covered: bool,
}

/// The covered parts of each layer of a figure.
#[derive(Clone, Debug)]
pub struct CoveredParts {
    /// **Shapes** one mask per layer.
    masks: Vec<PerVertex<bool>>,
    /// What remains of each layer; `None` if nothing is to be removed.
    visible: Option<Vec<VisiblePart>>,
}

impl CoveredParts {
    /// Nothing is marked and nothing removed.
    pub fn none() -> Self {
        Self { masks: Vec::new(), visible: None }
    }

    /// Marks what is covered and, if that is to be removed, computes what remains.
    ///
    /// **Shapes** one mask per layer, as [`cover_masks`](crate::rig::cover_masks) computes them.
    pub fn of(figure: &Figure, masks: Vec<PerVertex<bool>>, remove: bool) -> Result<Self, ExportError> {
        let remaining = |(layer, mask): (&Layer, &PerVertex<bool>)| visible_part(&layer.name, &layer.mesh, mask);
        let visible =
            remove.then(|| figure.layers.iter().zip(&masks).map(remaining).collect::<Result<_, _>>()).transpose()?;
        Ok(Self { masks, visible })
    }

    /// The layers of `figure` that remain, with the masks of their vertices. The figure is the one of the masks, or one with
    /// the same faces.
    pub fn remaining(self, mut figure: Figure) -> (Figure, Vec<PerVertex<bool>>) {
        let Self { mut masks, visible } = self;
        for ((layer, mask), part) in figure.layers.iter_mut().zip(&mut masks).zip(visible.iter().flatten()) {
            if part.removed_area > 0.0 {
                let (remaining, kept) = layer.part(&part.faces);
                *mask = kept.iter().map(|&v| mask[v]).collect();
                *layer = remaining;
            }
        }
        (figure, masks)
    }

    /// What remains of a layer, and which of its vertices; `None` if it stays whole.
    pub fn remaining_layer(&self, rank: usize, layer: &Layer) -> Option<(Layer, PerVertex<VertexId>)> {
        let part = self.visible.as_ref()?.get(rank)?;
        (part.removed_area > 0.0).then(|| layer.part(&part.faces))
    }

    /// What remains of the surface of a layer, and of its colours.
    pub fn remaining_surface(
        &self,
        rank: usize,
        mesh: &TriMesh,
        colors: Option<&PerVertex<[u8; 3]>>,
    ) -> (TriMesh, Option<PerVertex<[u8; 3]>>) {
        match self.visible.as_ref().and_then(|parts| parts.get(rank)).filter(|part| part.removed_area > 0.0) {
            None => (mesh.clone(), colors.cloned()),
            Some(part) => {
                let (remaining, kept) = mesh.part(&part.faces);
                (remaining, colors.map(|colors| kept.iter().map(|&v| colors[v]).collect()))
            }
        }
    }

    /// What is removed of each layer; empty if nothing is to be removed.
    pub fn removed(&self, figure: &Figure) -> Vec<RemovedPart> {
        let removed = |(layer, part): (&Layer, &VisiblePart)| RemovedPart {
            layer: layer.name.clone(),
            area: part.area,
            removed_area: part.removed_area,
            is_all_covered: part.is_all_covered,
        };
        figure.layers.iter().zip(self.visible.iter().flatten()).map(removed).collect()
    }
}
