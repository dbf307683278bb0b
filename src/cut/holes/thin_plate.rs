//! Points of which each is the weighted mean of its neighbours, as nearly as possible: a thin plate.

use crate::geometry::{Point, Vec3};
use crate::numerics::{NumericsError, SparseCholesky};

/// The normal equations of `min Σ |x_v − weighted mean of its neighbours|²`, with some points known.
pub(in crate::cut) struct ThinPlate {
    triplets: Vec<(usize, usize, f64)>,
    right: Vec<Vec3>,
}

impl ThinPlate {
    /// Without a term yet.
    pub(in crate::cut) fn new(unknowns: usize) -> Self {
        Self { triplets: Vec::new(), right: vec![Vec3::zeros(); unknowns] }
    }

    /// Adds `|Σ factor · x + known|²`, the sum over unknown points by their index.
    pub(in crate::cut) fn add(&mut self, unknown: &[(usize, f64)], known: Vec3) {
        for &(a, fa) in unknown {
            self.right[a] -= known * fa;
            self.triplets.extend(unknown.iter().map(|&(b, fb)| (a, b, fa * fb)));
        }
    }

    /// The points.
    pub(in crate::cut) fn solved(self) -> Result<Vec<Point>, NumericsError> {
        let system = SparseCholesky::prepare(self.right.len(), &self.triplets)?;
        Ok(system.solve_vectors(&self.right).into_iter().map(Point::from).collect())
    }
}
