//! What is known about a simulation of cloth.

use super::crossing_free::near_pairs::still_faces;
use super::crossing_free::surfaces::Surfaces;
use super::crossing_free::swept_tree::SweptTree;
use super::mode::ClothSolver;
use crate::geometry::{Point, triangles_cross};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What is known about a simulation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ClothReport {
    /// Pairs of crossing faces, over all frames: between layers, with the body, and within each; counted on the `f32`
    /// positions of each frame. 0 for coupled cloth and for physics by constraints, unless the program has a fault; not counted
    /// for a draft.
    pub crossing_pairs: Option<usize>,
    /// The first frame with crossing faces.
    pub first_crossing: Option<usize>,
    /// Greatest distance of the body's surface from its skinned place, metres: how far it had to give way.
    pub yielded: f64,
    /// Greatest share of the body's vertices in a frame that gave way by more than 5 mm.
    pub yielded_share: f64,
    /// Steps in which everything had to stop.
    pub stopped_steps: usize,
    /// Root mean square over frames and vertices of cloth of the distance from the skinned place, metres.
    pub swing: f64,
    /// Swing of the hem that swings most: root mean square over its vertices and the frames, metres.
    pub hem_swing: f64,
    /// 99th percentile of the stretch of the edges of cloth: length in proportion to that in the bind pose; that of the
    /// worst frame.
    pub stretch_p99: f64,
    /// Least share of its fabric's stiffness that a spring of the mass–spring solver has: stiffer ones would need shorter
    /// steps. 1 for constraints.
    pub least_stiffness: f64,
}

/// Collects a report over the frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Reporter {
    report: ClothReport,
    squares: f64,
    /// The vertices of each boundary loop of cloth, and the sum over the frames of their mean squared distance.
    hems: Vec<(Vec<usize>, f64)>,
    frames: usize,
}

impl Reporter {
    /// **Shapes** `hems`: the vertices of each boundary loop of cloth.
    pub fn new(solver: ClothSolver, hems: Vec<Vec<usize>>) -> Self {
        let crossing_pairs = (solver != ClothSolver::Draft).then_some(0);
        let report = ClothReport { crossing_pairs, stretch_p99: 1.0, least_stiffness: 1.0, ..ClothReport::default() };
        let hems = hems.into_iter().filter(|hem| !hem.is_empty()).map(|hem| (hem, 0.0)).collect();
        Self { report, squares: 0.0, hems, frames: 0 }
    }

    /// Adds frame number `frame`: where everything is, and where skinning alone puts it.
    pub fn add(&mut self, frame: usize, surfaces: &Surfaces, tree: &SweptTree, at: &[Point], places: &[Point]) {
        let report = &mut self.report;
        if let Some(pairs) = &mut report.crossing_pairs {
            let crossing = crossing_pairs(surfaces, tree, at);
            *pairs += crossing;
            report.first_crossing = report.first_crossing.or((crossing > 0).then_some(frame));
        }
        let (yielded, share) = yielded(surfaces, at, places);
        report.yielded = report.yielded.max(yielded);
        report.yielded_share = report.yielded_share.max(share);
        report.stretch_p99 = report.stretch_p99.max(stretch_p99(surfaces, at));
        let body = surfaces.body_vertices();
        self.squares += squared_swing(body..at.len(), at, places);
        for (hem, squares) in &mut self.hems {
            *squares += squared_swing(hem.iter().copied(), at, places);
        }
        self.frames += 1;
    }

    pub fn finish(self, stopped_steps: usize, least_stiffness: f64) -> ClothReport {
        let swing = |squares: f64| (squares / self.frames.max(1) as f64).sqrt();
        let hem_swing = self.hems.iter().map(|(_, squares)| swing(*squares)).fold(0.0, f64::max);
        ClothReport { swing: swing(self.squares), hem_swing, stopped_steps, least_stiffness, ..self.report }
    }
}

/// Positions in the precision of files.
pub(super) fn rounded(at: &[Point]) -> Vec<[f32; 3]> {
    at.iter().map(|p| [p.x as f32, p.y as f32, p.z as f32]).collect()
}

/// The number of pairs of faces without a common vertex that cross, in the precision of files.
pub(super) fn crossing_pairs(surfaces: &Surfaces, tree: &SweptTree, at: &[Point]) -> usize {
    let at: Vec<Point> = rounded(at).into_iter().map(|p| Point::from(p.map(f64::from))).collect();
    let faces = still_faces(surfaces, &at);
    let boxes = tree.boxes(&faces);
    let count = |task| {
        let mut crossing = 0;
        tree.visit(task, &boxes, &faces, 0.0, |f, g| {
            let [f, g] = [f, g].map(|k| surfaces.faces[k as usize]);
            let corners = |face: [u32; 3]| face.map(|v| at[v as usize]);
            let apart = !f.iter().any(|v| g.contains(v));
            crossing += usize::from(apart && triangles_cross(&corners(f), &corners(g)));
        });
        crossing
    };
    tree.tasks(&boxes, 0.0).into_par_iter().map(count).sum()
}

/// Greatest distance of the skin from its place, and the share of its vertices that are more than 5 mm off.
fn yielded(surfaces: &Surfaces, at: &[Point], places: &[Point]) -> (f64, f64) {
    let body = surfaces.body_vertices();
    let off: Vec<f64> = (0..body).map(|v| (at[v] - places[v]).norm()).collect();
    let far = off.iter().filter(|&&d| d > 5e-3).count();
    (off.iter().copied().fold(0.0, f64::max), far as f64 / body.max(1) as f64)
}

/// Mean squared distance of vertices from their skinned places.
fn squared_swing(vertices: impl ExactSizeIterator<Item = usize>, at: &[Point], places: &[Point]) -> f64 {
    let count = vertices.len().max(1) as f64;
    vertices.map(|v| (at[v] - places[v]).norm_squared()).sum::<f64>() / count
}

fn stretch_p99(surfaces: &Surfaces, at: &[Point]) -> f64 {
    let body = surfaces.body_vertices() as u32;
    let length = |at: &[Point], [a, b]: [u32; 2]| (at[a as usize] - at[b as usize]).norm();
    let edges = surfaces.edges.iter().filter(|edge| edge[0] >= body);
    let stretch = edges.map(|&edge| length(at, edge) / length(&surfaces.rest, edge).max(1e-6));
    let mut stretches: Vec<f64> = stretch.collect();
    stretches.sort_by(f64::total_cmp);
    stretches.get(stretches.len() * 99 / 100).copied().unwrap_or(1.0)
}
