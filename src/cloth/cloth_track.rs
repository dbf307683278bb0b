//! The surfaces of a figure over time, as simulated.

use crate::geometry::{PerVertex, Point};
use serde::{Deserialize, Serialize};

/// The vertices of every layer in every frame, in `f32`, as they are exported: what was certified is what is written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClothTrack {
    /// The number of vertices of each layer, the body first.
    pub vertices: Vec<u32>,
    /// Positions in the world, metres, Y up.
    ///
    /// **Shapes** one entry per frame, each V × 3: the vertices of all layers, one layer after another.
    pub frames: Vec<Vec<[f32; 3]>>,
}

impl ClothTrack {
    /// The vertices of every layer in one frame.
    ///
    /// **Shapes** one entry per layer, the body first; empty for a frame that does not exist.
    pub fn layers_in(&self, frame: usize) -> Vec<PerVertex<Point>> {
        let known = if frame < self.frames.len() { self.vertices.len() } else { 0 };
        (0..known).map(|rank| self.layer(rank, frame)).collect()
    }

    /// The vertices of one layer in one frame; empty for a layer or a frame that does not exist.
    ///
    /// **Shapes** one entry per vertex of the layer.
    pub fn layer(&self, rank: usize, frame: usize) -> PerVertex<Point> {
        let first: usize = self.vertices.iter().take(rank).map(|&count| count as usize).sum();
        let count = self.vertices.get(rank).map_or(0, |&count| count as usize);
        let points = self.frames.get(frame).and_then(|points| points.get(first..first + count)).unwrap_or_default();
        points.iter().map(|p| Point::from(p.map(f64::from))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_divided_among_its_layers() {
        let frame: Vec<[f32; 3]> = (0..5u8).map(|k| [f32::from(k), 0.0, 1.0]).collect();
        let track = ClothTrack { vertices: vec![3, 2], frames: vec![frame] };
        let layers = track.layers_in(0);
        assert_eq!(layers.iter().map(PerVertex::len).collect::<Vec<_>>(), [3, 2]);
        assert_eq!(layers[1].0[0], Point::new(3.0, 0.0, 1.0));
        assert!(track.layers_in(1).is_empty() && track.layer(2, 0).is_empty() && track.layer(0, 1).is_empty());
    }
}
