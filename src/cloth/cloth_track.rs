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
        let Some(points) = self.frames.get(frame) else { return Vec::new() };
        let mut rest = points.as_slice();
        let layer = |&count: &u32| {
            let (own, after) = rest.split_at((count as usize).min(rest.len()));
            rest = after;
            own.iter().map(|p| Point::from(p.map(f64::from))).collect()
        };
        self.vertices.iter().map(layer).collect()
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
        assert!(track.layers_in(1).is_empty());
    }
}
