//! Distance constraints between the vertices of a layer.

use super::layer::ClothLayer;
use crate::geometry::{Adjacency, Point, VertexId};

/// A distance constraint between two vertices.
pub(super) struct Spring {
    pub ends: [u32; 2],
    /// At rest, metres.
    pub length: f64,
    /// N/m.
    stiffness: f64,
    /// Compliance over the square of the step, 1/kg.
    softness: f64,
}

/// A spring per edge against stretch, and after them one across each inner edge against bending, for steps of `step_secs`.
pub(super) fn springs_of(layer: &ClothLayer, step_secs: f64) -> Vec<Spring> {
    /// Springs across an edge resist bending by their lever arm; with equal triangles of side `l` the spring of rigidity
    /// `B` has `12 B / l²`.
    const LEVER: f64 = 12.0;
    let adjacency = Adjacency::prepare(&layer.rest);
    let points = layer.rest.points();
    let side = layer.rest.mean_edge_length().max(1e-4);
    let spring = |a: VertexId, b: VertexId, stiffness: f64| {
        let length = (points[a] - points[b]).norm();
        let mut spring = Spring { ends: [a.0, b.0], length, stiffness, softness: 0.0 };
        spring.set_step(step_secs);
        spring
    };
    let bending = LEVER * layer.fabric.bending / (side * side);
    let along = adjacency.edges().iter().map(|&([a, b], _)| spring(a, b, layer.fabric.stretch));
    let across = adjacency.edges().iter().filter_map(|&(edge, faces)| {
        let [Some(f), Some(g)] = faces else { return None };
        let opposite = |f| layer.rest.faces()[f].into_iter().find(|v| !edge.contains(v));
        Some(spring(opposite(f)?, opposite(g)?, bending))
    });
    along.chain(across).collect()
}

impl Spring {
    /// Prepares for steps of another length.
    pub fn set_step(&mut self, step_secs: f64) {
        self.softness = 1.0 / (self.stiffness * step_secs * step_secs);
    }

    /// Moves the two ends towards the rest length, the lighter by more.
    pub fn satisfy(&self, at: &mut [Point], inverse_mass: &[f64]) {
        let [a, b] = self.ends.map(|v| v as usize);
        let both = inverse_mass[a] + inverse_mass[b];
        let d = at[b] - at[a];
        let length = d.norm();
        if both == 0.0 || length < 1e-9 {
            return;
        }
        let correction = d * ((length - self.length) / (length * (both + self.softness)));
        at[a] += correction * inverse_mass[a];
        at[b] -= correction * inverse_mass[b];
    }
}
