//! The part of a garment around the vertices that must move, and its smoothing operator.

use super::required_moves::RequiredMoves;
use crate::geometry::{Adjacency, Laplacian, PerVertex, Vec3, VertexId};
use crate::numerics::{NumericsError, SparseCholesky};

/// How far the displacement reaches around the vertices that must move, in smoothing lengths. The response to one vertex
/// falls to 2 % there; farther away nothing moves.
const REACH_PER_LENGTH: f64 = 4.0;

/// `diag(M) + ℓ⁴ L M⁻¹ L` over some vertices; the others are fixed.
pub(super) struct MovableRegion {
    belongs: PerVertex<bool>,
    vertices: Vec<VertexId>,
    mass: Vec<f64>,
    factor: SparseCholesky,
}

impl MovableRegion {
    /// All vertices within reach of those that must move.
    pub(super) fn around(
        required: &RequiredMoves,
        length: f64,
        laplacian: &Laplacian,
        adjacency: &Adjacency,
        mean_edge_length: f64,
    ) -> Result<Self, NumericsError> {
        let count = required.moves().len();
        let rings = (REACH_PER_LENGTH * length / mean_edge_length.max(1e-6)).ceil() as usize;
        let mut belongs: PerVertex<bool> = required.moves().iter().map(|u| *u != Vec3::zeros()).collect();
        let mut front: Vec<VertexId> = (0..count).map(VertexId::from_index).filter(|&v| belongs[v]).collect();
        for _ in 0..rings {
            let mut next = Vec::new();
            for v in front {
                for &w in adjacency.neighbours_of(v) {
                    if !belongs[w] {
                        belongs[w] = true;
                        next.push(w);
                    }
                }
            }
            front = next;
        }
        let vertices: Vec<VertexId> = (0..count).map(VertexId::from_index).filter(|&v| belongs[v]).collect();
        // One more ring, for bending at the border; its rows come last and are dropped.
        let rim: Vec<VertexId> = front_around(&belongs, &vertices, adjacency);
        let mut local = vec![usize::MAX; count];
        for (i, v) in vertices.iter().chain(&rim).enumerate() {
            local[v.index()] = i;
        }
        let safe_mass = laplacian.safe_mass();
        let part = Laplacian {
            triplets: (laplacian.triplets.iter())
                .map(|&(i, j, value)| (local[i], local[j], value))
                .filter(|&(i, j, _)| i != usize::MAX && j != usize::MAX)
                .collect(),
            mass: vertices.iter().chain(&rim).map(|v| safe_mass[v.index()]).collect(),
        };
        let mut matrix = part.screened(&vec![1.0; part.mass.len()], 0.0, length.powi(4));
        matrix.retain(|&(i, j, _)| i < vertices.len() && j < vertices.len());
        Ok(Self {
            factor: SparseCholesky::prepare(vertices.len(), &matrix)?,
            mass: vertices.iter().map(|v| safe_mass[v.index()]).collect(),
            vertices,
            belongs,
        })
    }

    /// Whether the vertex may move.
    pub(super) fn has(&self, v: VertexId) -> bool {
        self.belongs[v]
    }

    /// The smooth displacement closest to the required moves; zero outside the region, whatever is required there.
    ///
    /// **Shapes** `V × 3`, in metres.
    pub(super) fn smoothed(&self, required: &RequiredMoves) -> PerVertex<Vec3> {
        let right: Vec<Vec3> = self.vertices.iter().zip(&self.mass).map(|(&v, m)| required.moves()[v] * *m).collect();
        let mut moves = PerVertex::filled(Vec3::zeros(), required.moves().len());
        for (&v, u) in self.vertices.iter().zip(self.factor.solve_vectors(&right)) {
            moves[v] = u;
        }
        moves
    }
}

fn front_around(belongs: &PerVertex<bool>, vertices: &[VertexId], adjacency: &Adjacency) -> Vec<VertexId> {
    let mut around: Vec<VertexId> =
        vertices.iter().flat_map(|&v| adjacency.neighbours_of(v)).copied().filter(|&w| !belongs[w]).collect();
    around.sort_unstable();
    around.dedup();
    around
}
