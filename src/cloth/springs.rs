//! Distance constraints between the vertices of a layer.

use super::fabric::Fabric;
use super::layer::ClothLayer;
use crate::geometry::{Adjacency, FaceId, Point, TriMesh, Vec3, VertexId};

/// Share of its stiffness with which a spring of [`stretch_springs`] resists being shortened: cloth that is pressed together buckles, in
/// folds narrower than its triangles. At 1 the sleeves of a foreign man's jacket did not give way in the armpits and stood off the arms
/// that came down, stretched across by 25 % (99th percentile of edges); at 0.1 his pullover was, by 13 %; at 0.2 and 0.3 all by at most 4 %.
const SHORTENED_SHARE: f64 = 0.2;
/// Factor of the stiffness of these springs. Those across a pull give way, so that cloth narrows and lengthens more: in equilateral triangles
/// by 1 / 0.69 across their sides, by 1 along them. With the factor the mean of both is the fabric's.
const STIFFER: f64 = 1.22;

/// A distance constraint between two vertices.
pub(super) struct Spring {
    pub ends: [u32; 2],
    /// At rest, metres.
    pub length: f64,
    /// N/m.
    pub stiffness: f64,
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

/// A spring per edge, against stretch.
///
/// A mesh of equilateral triangles stretches as a sheet of the fabric's resistance does, in the mean of two directions.
pub(super) fn stretch_springs(rest: &TriMesh, fabric: &Fabric) -> Vec<Spring> {
    let (points, adjacency) = (rest.points(), Adjacency::prepare(rest));
    let spring = |&([a, b], faces): &([VertexId; 2], [Option<FaceId>; 2])| {
        let length = (points[a] - points[b]).norm();
        let areas: f64 = faces.iter().flatten().map(|&f| rest.face_area(f)).sum();
        // Slivers are neither strings nor rods.
        let stiffness = STIFFER * fabric.stretch * (areas / (length * length).max(1e-12)).clamp(0.01, 100.0);
        Spring { ends: [a.0, b.0], length, stiffness, softness: 0.0 }
    };
    adjacency.edges().iter().map(spring).collect()
}

/// A round of the constraints of a layer, in their order or backwards.
pub(super) fn satisfy_all(springs: &[Spring], at: &mut [Point], inverse_mass: &[f64], backwards: bool) {
    let satisfy = |spring: &Spring| spring.satisfy(at, inverse_mass);
    if backwards { springs.iter().rev().for_each(satisfy) } else { springs.iter().for_each(satisfy) }
}

impl Spring {
    /// The force on the first end, newtons.
    pub fn pull(&self, at: &[Point]) -> Vec3 {
        let [a, b] = self.ends.map(|v| at[v as usize]);
        let (way, length) = (b - a, (b - a).norm());
        let stiffness = self.stiffness * self.share_at(length);
        if length < 1e-9 { Vec3::zeros() } else { way * (stiffness * (length - self.length) / length) }
    }

    /// The share of its stiffness that it has at a length.
    fn share_at(&self, length: f64) -> f64 {
        if length < self.length { SHORTENED_SHARE } else { 1.0 }
    }

    /// Prepares for steps of another length.
    pub fn set_step(&mut self, step_secs: f64) {
        self.softness = 1.0 / (self.stiffness * step_secs * step_secs);
    }

    /// What it pulled if its force is that of its length: see [`satisfy_with`](Self::satisfy_with).
    pub fn pulled(&self, at: &[Point]) -> f64 {
        let [a, b] = self.ends.map(|v| at[v as usize]);
        let length = (b - a).norm();
        (length - self.length) * self.share_at(length) / self.softness
    }

    /// Moves the two ends towards the rest length, the lighter by more. It does not buckle, and does not go by way of
    /// [`Self::satisfy_with`]: the cloth of synthetic subjects depends on its rounding.
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

    /// The same, with what it pulled before, which its compliance bears (Macklin 2016): over many rounds the spring has its
    /// stiffness.
    pub fn satisfy_with(&self, at: &mut [Point], inverse_mass: impl Fn(u32) -> f64, pulled: &mut f64) {
        let inverse_mass = self.ends.map(inverse_mass);
        let [a, b] = self.ends.map(|v| v as usize);
        let both = inverse_mass[0] + inverse_mass[1];
        let d = at[b] - at[a];
        let length = d.norm();
        if both == 0.0 || length < 1e-9 {
            return;
        }
        let softness = self.softness / self.share_at(length);
        let more = (length - self.length - softness * *pulled) / (both + softness);
        *pulled += more;
        let correction = d * (more / length);
        at[a] += correction * inverse_mass[0];
        at[b] -= correction * inverse_mass[1];
    }
}
