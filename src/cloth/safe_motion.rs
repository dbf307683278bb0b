//! Displacements within a step, corrected until no two surfaces cross on their way: the guarantee of the simulation.

use super::near_pairs::{NearPair, Search, way_between};
use super::surfaces::Surfaces;
use super::swept_tree::SweptTree;
use crate::geometry::{Point, Vec3};
use rayon::prelude::*;

/// No pair comes nearer than this, metres: thirty times the rounding of a metre to the `f32` of files.
const LEAST_DISTANCE: f64 = 3e-6;
/// Nor nearer than this share of its distance at the start of the step, so that there is always room for the next.
const LEAST_SHARE: f64 = 0.1;
/// Rounds in which pairs part by impulses before they are joined to rigid zones. The first 150 frames of a walk in four
/// layers (the demo) took up to 160 in all; a round looks only at what the one before has moved.
const ROUNDS: usize = 160;
/// From this round on, every other round also averages the displacements of a pair.
const AVERAGING_ROUND: usize = 40;
/// Searches for vertices that left their slack. The slack doubles each time, so that eight cover 4 cm per step.
const SEARCHES: usize = 8;
/// Slack of a vertex that has left its own, metres.
const NEW_SLACK: f64 = 0.3e-3;
/// Mass of a vertex of the body beside one of cloth: cloth gives way first.
const BODY_MASS: f64 = 10.0;

/// What was corrected.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Corrections {
    /// Pairs that would have come too near.
    pub pairs: usize,
    /// Vertices that had to be joined to rigid zones.
    pub zone_vertices: usize,
    /// Whether nothing moves in this step because no other displacement was found that is safe.
    pub stopped: bool,
}

/// A step: where everything is, and how it is expected to move.
pub(super) struct Step<'a> {
    pub surfaces: &'a Surfaces,
    pub tree: &'a SweptTree,
    pub at: &'a [Point],
    /// The gap that contact keeps, metres.
    pub gap: f64,
}

impl Step<'_> {
    /// Corrects `by` until no pair of primitives crosses while all vertices move on straight lines.
    ///
    /// `pairs` are those that may come near if every displacement is within `slack` of `expected`; pairs of vertices
    /// that leave it are added.
    ///
    /// **Shapes** `by`, `expected`, `slack`: one entry per vertex.
    ///
    /// **Guarantees** surfaces that do not cross at the start do not cross at any moment of the step. The result does not
    /// depend on the number of threads.
    ///
    /// **Source** conservative advancement (Li et al. 2021, §B) decides; impulses (Bridson 2002) and rigid zones
    /// (Provot 1997) correct.
    pub fn make_safe(
        &self,
        pairs: &mut Vec<NearPair>,
        by: &mut [Vec3],
        expected: &mut [Vec3],
        slack: &mut [f64],
    ) -> Corrections {
        let mut corrections = Corrections::default();
        for search in 0..SEARCHES {
            let strayed: Vec<usize> =
                (0..by.len()).filter(|&v| (by[v] - expected[v]).norm() > slack[v] * (1.0 + 1e-9)).collect();
            if strayed.is_empty() && search > 0 {
                return corrections;
            }
            if !strayed.is_empty() {
                for &v in &strayed {
                    expected[v] = by[v];
                    slack[v] = NEW_SLACK * f64::from(1 << search);
                }
                pairs.extend(self.pairs_of(&strayed, expected, slack));
            }
            self.part(pairs, by, &mut corrections);
        }
        by.fill(Vec3::zeros());
        corrections.stopped = true;
        corrections
    }

    fn pairs_of(&self, vertices: &[usize], expected: &[Vec3], slack: &[f64]) -> Vec<NearPair> {
        let mut strayed = vec![false; self.at.len()];
        vertices.iter().for_each(|&v| strayed[v] = true);
        let faces = self.surfaces.faces.iter().enumerate();
        let faces: Vec<u32> =
            faces.filter(|(_, f)| f.iter().any(|&v| strayed[v as usize])).map(|(k, _)| k as u32).collect();
        let Self { surfaces, tree, at, gap, .. } = *self;
        // Only the guarantee is at stake here, and not contact.
        Search { surfaces, tree, at, by: expected, slack, reach: 0.0, gap }.of_faces(&faces)
    }

    /// Corrects `by` until no pair comes too near.
    fn part(&self, pairs: &[NearPair], by: &mut [Vec3], corrections: &mut Corrections) {
        let too_near = |by: &[Vec3]| -> Vec<u32> {
            (0..pairs.len() as u32).into_par_iter().filter(|&p| self.is_too_near(&pairs[p as usize], by)).collect()
        };
        let mut active = too_near(by);
        corrections.pairs += active.len();
        if active.is_empty() {
            return;
        }
        let of_vertex = PairsOfVertex::prepare(pairs, by.len());
        let mut queued = vec![false; pairs.len()];
        for round in 0..ROUNDS {
            let averages = round >= AVERAGING_ROUND && round % 2 == 1;
            let mut moved: Vec<u32> = Vec::new();
            for &p in &active {
                let pair = &pairs[p as usize];
                if self.push_apart(pair, by, averages) {
                    moved.extend(pair.vertices);
                }
            }
            let mut next: Vec<u32> = Vec::new();
            for p in moved.iter().flat_map(|&v| of_vertex.of(v)) {
                if !std::mem::replace(&mut queued[*p as usize], true) {
                    next.push(*p);
                }
            }
            next.iter().for_each(|&p| queued[p as usize] = false);
            next.retain(|&p| self.is_too_near(&pairs[p as usize], by));
            next.sort_unstable();
            active = next;
            if active.is_empty() {
                return;
            }
        }
        let mut zones = Zones::of_single(by.len());
        loop {
            let left = too_near(by);
            let joined = left.iter().filter(|&&p| zones.join(&pairs[p as usize].vertices)).count();
            // Vertices of one zone move as one, so each round joins some until no pair is left.
            if joined == 0 {
                break;
            }
            zones.move_as_one(by, |v| self.mass(v));
        }
        corrections.zone_vertices += zones.joined_vertices();
    }

    /// Relative mass of a vertex.
    fn mass(&self, v: usize) -> f64 {
        if v < self.surfaces.body_vertices() { BODY_MASS } else { 1.0 }
    }

    /// Takes from the two sides of a pair what they approach each other too much, or averages their motion if that is not the
    /// cause. Returns whether anything changed.
    fn push_apart(&self, pair: &NearPair, by: &mut [Vec3], averages: bool) -> bool {
        /// Share of the room that the closest points may use; the rest is left to the rotation of the primitives.
        const USED: f64 = 0.7;
        /// Share of the way to their mean displacement that vertices are moved per round.
        const SOFT: f64 = 0.3;
        let vertices = pair.vertices.map(|v| v as usize);
        let weights = pair.weights.map(f64::from);
        let approach = -vertices.iter().zip(weights).map(|(&v, w)| w * pair.normal.dot(&by[v])).sum::<f64>();
        let excess = approach - USED * (pair.distance - least_distance(pair));
        if excess > 0.0 && !averages {
            let denominator: f64 = vertices.iter().zip(weights).map(|(&v, w)| w * w / self.mass(v)).sum();
            for (&v, w) in vertices.iter().zip(weights) {
                by[v] += pair.normal * (excess * w / (denominator * self.mass(v)));
            }
            return true;
        }
        if !self.is_too_near(pair, by) {
            return false;
        }
        let mean = vertices.iter().map(|&v| by[v]).sum::<Vec3>() / 4.0;
        for &v in &vertices {
            by[v] += (mean - by[v]) * (SOFT / self.mass(v).sqrt());
        }
        true
    }

    /// Whether a pair comes too near on its way.
    ///
    /// **Guarantees** `false` only if it does not: in each round the remaining distance is more than both sides can move.
    fn is_too_near(&self, pair: &NearPair, by: &[Vec3]) -> bool {
        /// Share of the safe time that is used, and the number of times: slow approaches count as too near.
        const ADVANCE: f64 = 0.9;
        const ADVANCES: usize = 64;
        let least = least_distance(pair);
        let split = usize::from(pair.split);
        let moves = pair.vertices.map(|v| by[v as usize]);
        let along = moves.map(|m| pair.normal.dot(&m));
        let most = |values: &[f64]| values.iter().fold(f64::MIN, |a, &b| a.max(b));
        let closing = most(&along[..split]) + most(&along.map(|a| -a)[split..]);
        // The plane between them, moved along, keeps most pairs apart.
        if closing <= pair.distance - least {
            return false;
        }
        let at = pair.vertices.map(|v| self.at[v as usize]);
        let mean = moves.iter().sum::<Vec3>() / 4.0;
        let moves = moves.map(|m| m - mean);
        let lengths = moves.map(|m| m.norm());
        let speed = most(&lengths[..split]) + most(&lengths[split..]);
        let (mut time, mut distance) = (0.0, pair.distance);
        for _ in 0..ADVANCES {
            let safe = (distance - least) / speed;
            if time + safe >= 1.0 {
                return false;
            }
            time += ADVANCE * safe;
            let now = std::array::from_fn(|k| at[k] + moves[k] * time);
            distance = way_between(&now, pair.split).0.norm();
            if distance < 1.05 * least {
                return true;
            }
        }
        true
    }
}

/// The distance below which a pair is too near.
fn least_distance(pair: &NearPair) -> f64 {
    (LEAST_SHARE * pair.distance).max(LEAST_DISTANCE).min(0.9 * pair.distance)
}

/// The pairs of each vertex.
struct PairsOfVertex {
    first: Vec<u32>,
    pairs: Vec<u32>,
}

impl PairsOfVertex {
    fn prepare(pairs: &[NearPair], vertices: usize) -> Self {
        let mut first = vec![0; vertices + 1];
        pairs.iter().flat_map(|p| p.vertices).for_each(|v| first[v as usize + 1] += 1);
        for v in 0..vertices {
            first[v + 1] += first[v];
        }
        let (mut next, mut list) = (first.clone(), vec![0; 4 * pairs.len()]);
        for (k, pair) in pairs.iter().enumerate() {
            for v in pair.vertices {
                list[next[v as usize] as usize] = k as u32;
                next[v as usize] += 1;
            }
        }
        Self { first, pairs: list }
    }

    fn of(&self, v: u32) -> &[u32] {
        &self.pairs[self.first[v as usize] as usize..self.first[v as usize + 1] as usize]
    }
}

/// Sets of vertices that move as one.
struct Zones {
    parent: Vec<u32>,
}

impl Zones {
    fn of_single(vertices: usize) -> Self {
        Self { parent: (0..vertices as u32).collect() }
    }

    fn root(&mut self, mut v: u32) -> u32 {
        while self.parent[v as usize] != v {
            self.parent[v as usize] = self.parent[self.parent[v as usize] as usize];
            v = self.parent[v as usize];
        }
        v
    }

    /// Joins the zones of four vertices; returns whether they were not one before.
    fn join(&mut self, vertices: &[u32; 4]) -> bool {
        let first = self.root(vertices[0]);
        let mut joined = false;
        for &v in &vertices[1..] {
            let root = self.root(v);
            joined |= root != first;
            self.parent[root as usize] = first;
        }
        joined
    }

    /// Gives all vertices of a zone their mean displacement, by mass.
    fn move_as_one(&mut self, by: &mut [Vec3], mass: impl Fn(usize) -> f64) {
        let roots: Vec<usize> = (0..by.len() as u32).map(|v| self.root(v) as usize).collect();
        let mut sums = vec![(Vec3::zeros(), 0.0, 0); by.len()];
        for (v, &root) in roots.iter().enumerate() {
            let (moment, total, count) = &mut sums[root];
            *moment += by[v] * mass(v);
            *total += mass(v);
            *count += 1;
        }
        for (v, &root) in roots.iter().enumerate() {
            let (moment, total, count) = sums[root];
            if count > 1 {
                by[v] = moment / total;
            }
        }
    }

    fn joined_vertices(&mut self) -> usize {
        let mut sizes = vec![0; self.parent.len()];
        for v in 0..self.parent.len() as u32 {
            sizes[self.root(v) as usize] += 1;
        }
        sizes.into_iter().filter(|&size| size > 1).sum()
    }
}
