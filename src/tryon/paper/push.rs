//! One round of the removal of interpenetration: a linear least-squares problem over the garment's moves.
//!
//! **Source** Shi 2020, Eqs. 19–21, with the changes that `clear` lists. The normal equations are solved by
//! conjugate gradients with the diagonal as preconditioner: a factorisation of three coupled coordinates over two-rings takes
//! longer than all rounds.

use crate::geometry::{Adjacency, FaceId, PerVertex, Point, TriMesh, Vec3, VertexId};
use rayon::prelude::*;

/// κ: distance of the garment from the skin, in metres.
pub const KAPPA: f64 = 0.002;
/// Weight of the damping per round, relative to λ_1 at first.
const DAMPING: f64 = 0.01;
/// Most steps of conjugate gradients per round; later rounds go on where this one ends.
const STEPS: usize = 40;
/// They end when the residual is this share of the right-hand side.
const RESIDUAL: f64 = 1e-3;
/// Vertices per task: fewer are done sooner than shared out.
const PER_TASK: usize = 512;

/// A point of the garment and the skin near it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Match {
    /// The garment's vertex, or both ends of an edge in whose middle the point is.
    pub(super) ends: [VertexId; 2],
    pub(super) face: FaceId,
    /// f_dot of Eq. 18: signed distance, negative inside.
    pub(super) distance: f64,
    /// Unit vector that leads out of the body.
    pub(super) outward: Vec3,
    /// Where the point was when the face was found.
    pub(super) at: Point,
    /// Whether it has no way out.
    pub(super) is_trapped: bool,
    /// Whether it is pushed out.
    pub(super) is_held: bool,
}

/// D of Eq. 21: a vertex's move minus the mean of its neighbours' by inverse edge length. ω = ‖D x‖².
pub(super) struct Smoothness {
    /// Where each vertex's neighbours begin in `neighbours` and `back`.
    first: Vec<usize>,
    neighbours: Vec<(u32, f64)>,
    /// Dᵀ: who has this vertex as a neighbour, and with which weight.
    back: Vec<(u32, f64)>,
}

impl Smoothness {
    pub(super) fn of(mesh: &TriMesh, adjacency: &Adjacency) -> Self {
        let weight = |v: VertexId, n: VertexId| 1.0 / (mesh.points()[v] - mesh.points()[n]).norm().max(1e-6);
        let sum = |v: VertexId| adjacency.neighbours_of(v).iter().map(|&n| weight(v, n)).sum::<f64>();
        let sums: PerVertex<f64> = mesh.vertex_ids().map(sum).collect();
        let (mut first, mut neighbours, mut back) = (vec![0], Vec::new(), Vec::new());
        for v in mesh.vertex_ids() {
            for &n in adjacency.neighbours_of(v) {
                neighbours.push((n.0, weight(v, n) / sums[v]));
                back.push((n.0, weight(v, n) / sums[n]));
            }
            first.push(neighbours.len());
        }
        Self { first, neighbours, back }
    }

    /// x minus the weighted sum of others: D x with the weights of `neighbours`, Dᵀ x with those of `back`.
    fn apply(&self, weights: &[(u32, f64)], x: &[Vec3], into: &mut [Vec3]) {
        let row = |v: usize| {
            let around = &weights[self.first[v]..self.first[v + 1]];
            around.iter().fold(x[v], |sum, &(n, w)| sum - x[n as usize] * w)
        };
        into.par_iter_mut().with_min_len(PER_TASK).enumerate().for_each(|(v, out)| *out = row(v));
    }

    /// DᵀD x.
    fn squared(&self, x: &[Vec3], scratch: &mut [Vec3], into: &mut [Vec3]) {
        self.apply(&self.neighbours, x, scratch);
        self.apply(&self.back, scratch, into);
    }

    /// The diagonal of DᵀD.
    fn diagonal(&self) -> Vec<f64> {
        let of = |v: usize| 1.0 + self.back[self.first[v]..self.first[v + 1]].iter().map(|(_, w)| w * w).sum::<f64>();
        (0..self.first.len() - 1).map(of).collect()
    }
}

/// λ_1 Σ (κ − f)² + λ_2 ω + damping, of the moves of one round.
pub(super) struct Push<'a> {
    pub(super) smoothness: &'a Smoothness,
    pub(super) matches: &'a [Match],
    pub(super) lambda_1: f64,
    pub(super) lambda_2: f64,
}

impl Push<'_> {
    fn held(&self) -> impl Iterator<Item = &Match> {
        self.matches.iter().filter(|m| m.is_held)
    }

    /// (λ_1 Σ n nᵀ + λ_2 DᵀD + δ) x.
    fn times(&self, x: &[Vec3], scratch: &mut [Vec3], into: &mut [Vec3]) {
        self.smoothness.squared(x, scratch, into);
        into.iter_mut().zip(x).for_each(|(out, x)| *out = *out * self.lambda_2 + x * DAMPING);
        for m in self.held() {
            let [a, b] = m.ends.map(VertexId::index);
            let along = 0.5 * m.outward.dot(&(x[a] + x[b]));
            let pull = m.outward * (0.5 * self.lambda_1 * along);
            into[a] += pull;
            into[b] += pull;
        }
    }

    /// The moves of this round. `so_far`: those of all rounds before. **Shapes** one per vertex.
    pub(super) fn solve(&self, so_far: &[Vec3]) -> Vec<Vec3> {
        let count = so_far.len();
        let (mut scratch, mut product) = (vec![Vec3::zeros(); count], vec![Vec3::zeros(); count]);
        self.smoothness.squared(so_far, &mut scratch, &mut product);
        let mut residual: Vec<Vec3> = product.iter().map(|p| -p * self.lambda_2).collect();
        let mut diagonal: Vec<f64> = self.smoothness.diagonal().iter().map(|d| d * self.lambda_2 + DAMPING).collect();
        for m in self.held() {
            for v in m.ends.map(VertexId::index) {
                residual[v] += m.outward * (0.5 * self.lambda_1 * (KAPPA - m.distance));
                diagonal[v] += 0.5 * self.lambda_1 / 3.0;
            }
        }
        let dot = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
        let mut x = vec![Vec3::zeros(); count];
        let mut scaled: Vec<Vec3> = residual.iter().zip(&diagonal).map(|(r, d)| r / *d).collect();
        let mut direction = scaled.clone();
        let mut energy = dot(&residual, &scaled);
        let enough = energy * RESIDUAL * RESIDUAL;
        for _ in 0..STEPS {
            if energy <= enough || energy <= 0.0 {
                break;
            }
            self.times(&direction, &mut scratch, &mut product);
            let step = energy / dot(&direction, &product).max(f64::MIN_POSITIVE);
            for v in 0..count {
                x[v] += direction[v] * step;
                residual[v] -= product[v] * step;
                scaled[v] = residual[v] / diagonal[v];
            }
            let next = dot(&residual, &scaled);
            direction.iter_mut().zip(&scaled).for_each(|(d, s)| *d = s + *d * (next / energy));
            energy = next;
        }
        x
    }
}
