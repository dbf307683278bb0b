//! How far each vertex must still move.

use crate::geometry::{PerVertex, Vec3, VertexId};

/// The move that each vertex lacks; zero where nothing is asked.
#[derive(Clone, Debug)]
pub(super) struct Lack {
    moves: PerVertex<Vec3>,
}

impl Lack {
    pub(super) fn none(count: usize) -> Self {
        Self { moves: PerVertex::filled(Vec3::zeros(), count) }
    }

    /// Asks for a move. A vertex that is asked twice goes as far as either asks along its direction, not the sum.
    pub(super) fn ask(&mut self, v: VertexId, wanted: Vec3) {
        let length = wanted.norm();
        if length <= 0.0 {
            return;
        }
        let missing = length - self.moves[v].dot(&wanted) / length;
        if missing > 0.0 {
            self.moves[v] += wanted * (missing / length);
        }
    }

    /// How many vertices are asked.
    pub(super) fn count(&self) -> usize {
        self.moves.iter().filter(|m| **m != Vec3::zeros()).count()
    }

    pub(super) fn is_none(&self) -> bool {
        self.moves.iter().all(|m| *m == Vec3::zeros())
    }

    pub(super) fn moves(&self) -> &PerVertex<Vec3> {
        &self.moves
    }
}
