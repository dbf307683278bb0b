//! Buttons and other parts that the garments of a figure carry.

use crate::body::{Figure, Layer};
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::{self, Walk};
use crate::tryon::Trim;

/// The trim of a figure's garments, as far as no other garment covers it.
pub(in crate::session) struct Trims {
    /// How many layers the figure has without them.
    layers: usize,
    /// Each with the layer that carries it.
    of: Vec<(usize, Trim)>,
}

impl Session {
    /// The trim of all garments, or of those up to the named step. Runs nothing.
    pub(in crate::session) fn trims(&self, last: Option<&str>) -> Result<Trims, SessionError> {
        let results = pipeline::steps(&mut Walk::look(self), last)?;
        let mut carried = Vec::new();
        for (step, results) in self.recipe.steps.iter().zip(&results) {
            let Some(kept) = results.trim else { continue };
            let trim = self.store.load(kept)?;
            if trim.part_count() > 0 {
                carried.push((&step.name, trim));
            }
        }
        let Some(last) = results.last().filter(|_| !carried.is_empty()) else {
            return Ok(Trims { layers: 0, of: Vec::new() });
        };
        let figure = self.figure(last.figure)?;
        let surfaces: Vec<&TriMesh> = figure.layers.iter().map(|layer| &layer.mesh).collect();
        let seen = |(name, trim): (&String, Trim)| {
            let rank = figure.layers.iter().position(|layer| layer.name == *name)?;
            let seen = trim.uncovered(surfaces[rank], &surfaces[rank + 1..]);
            (seen.part_count() > 0).then_some((rank, seen))
        };
        let of = carried.into_iter().filter_map(seen).collect();
        Ok(Trims { layers: surfaces.len(), of })
    }
}

impl Trims {
    /// Each as a layer, with the name of the layer that carries it.
    ///
    /// **Requires** the vertices of the figure's layers as they were built.
    pub fn layers_on(&self, figure: &Figure) -> Vec<(String, Layer)> {
        let layer = |(rank, trim): &(usize, Trim)| {
            let carrier = &figure.layers[*rank];
            (carrier.name.clone(), trim.layer(carrier))
        };
        self.of.iter().map(layer).collect()
    }

    /// Their surfaces where those of the layers are, as far as there are these.
    pub fn carried_by(&self, layers: &[TriMesh]) -> Vec<TriMesh> {
        self.of.iter().filter_map(|(rank, trim)| Some(trim.on(layers.get(*rank)?.points()))).collect()
    }

    /// The figure with each of them as a layer after all others.
    ///
    /// **Requires** the vertices of the figure's layers as they were built.
    pub fn added_to(&self, mut figure: Figure) -> Figure {
        let layers = self.layers_on(&figure);
        figure.layers.extend(layers.into_iter().map(|(_, layer)| layer));
        figure
    }

    /// The vertices of one of their layers, where its carrier has these.
    ///
    /// **Shapes** one entry per vertex of the layer; `None` if the layer is a garment or the body.
    pub fn on(&self, rank: usize, layer: impl Fn(usize) -> PerVertex<Point>) -> Option<PerVertex<Point>> {
        let (carrier, trim) = self.of.get(rank.checked_sub(self.layers)?)?;
        Some(trim.on(&layer(*carrier)).points().clone())
    }
}
