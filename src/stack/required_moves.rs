//! The move that each vertex still needs.

use crate::geometry::{PerVertex, Vec3, VertexId};

/// The move that each vertex still needs, in metres; zero where none is required.
///
/// **Shapes** `moves`: `V × 3`.
#[derive(Clone, Debug)]
pub(super) struct RequiredMoves {
    moves: PerVertex<Vec3>,
}

impl RequiredMoves {
    pub(super) fn none(count: usize) -> Self {
        Self { moves: PerVertex::filled(Vec3::zeros(), count) }
    }

    /// Requires a move. A vertex with two requirements moves as far as each asks along its own direction, not by the sum.
    pub(super) fn require(&mut self, v: VertexId, wanted: Vec3) {
        let length = wanted.norm();
        if length <= 0.0 {
            return;
        }
        let missing = length - self.moves[v].dot(&wanted) / length;
        if missing > 0.0 {
            self.moves[v] += wanted * (missing / length);
        }
    }

    /// How many vertices must move.
    pub(super) fn count(&self) -> usize {
        self.moves.iter().filter(|m| **m != Vec3::zeros()).count()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.moves.iter().all(|m| *m == Vec3::zeros())
    }

    pub(super) fn moves(&self) -> &PerVertex<Vec3> {
        &self.moves
    }
}
