//! Symmetric positive definite systems.

use super::NumericsError;
use faer::linalg::solvers::Solve;
use faer::sparse::linalg::LltError;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{Argsort, CreationError, Pair, SparseColMat, SymbolicSparseColMat};
use faer::{MatMut, Par, Side};
use nalgebra::Vector3;

/// A factorised symmetric positive definite matrix `n × n`: factorise once, solve often.
///
/// **Guarantees** results do not depend on the number of threads.
pub struct SparseCholesky {
    size: usize,
    triplet_count: usize,
    /// Indices of the given triplets in the lower triangle.
    lower: Vec<usize>,
    pattern: SymbolicSparseColMat<usize>,
    order: Argsort<usize>,
    symbolic: SymbolicLlt<usize>,
    factor: Llt<usize, f64>,
}

impl SparseCholesky {
    /// Factorises the matrix of `(row, column, value)`; duplicate entries are summed.
    ///
    /// **Shapes** an `n × n` matrix, one triplet per entry.
    ///
    /// **Requires** the lower triangle and the diagonal. Entries above the diagonal are ignored, so a full symmetric matrix is
    /// accepted.
    pub fn prepare(n: usize, triplets: &[(usize, usize, f64)]) -> Result<Self, NumericsError> {
        // faer's threads made these solves ten times slower, and sums must not depend on the number of threads.
        faer::set_global_parallelism(Par::Seq);
        let lower: Vec<usize> = (0..triplets.len()).filter(|&i| triplets[i].0 >= triplets[i].1).collect();
        let entries: Vec<Pair<usize, usize>> = lower.iter().map(|&i| Pair::new(triplets[i].0, triplets[i].1)).collect();
        let (pattern, order) =
            SymbolicSparseColMat::try_new_from_indices(n, n, &entries).map_err(|error| match error {
                CreationError::OutOfBounds { row, col } => NumericsError::OutOfRange { row, column: col, size: n },
                CreationError::Generic(_) => NumericsError::OutOfMemory { size: n },
            })?;
        let symbolic =
            SymbolicLlt::try_new(pattern.as_ref(), Side::Lower).map_err(|_| NumericsError::OutOfMemory { size: n })?;
        let values: Vec<f64> = triplets.iter().map(|t| t.2).collect();
        let factor = factorise(n, &pattern, &order, &symbolic, &lower, &values)?;
        Ok(Self { size: n, triplet_count: triplets.len(), lower, pattern, order, symbolic, factor })
    }

    /// Factorises again with other values. **Shapes** one value per triplet of [`prepare`](Self::prepare), in that order.
    pub fn refactor(&mut self, values: &[f64]) -> Result<(), NumericsError> {
        if values.len() != self.triplet_count {
            return Err(NumericsError::WrongLength {
                what: "values of the matrix",
                given: values.len(),
                expected: self.triplet_count,
            });
        }
        self.factor = factorise(self.size, &self.pattern, &self.order, &self.symbolic, &self.lower, values)?;
        Ok(())
    }

    /// Number of unknowns.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Solves for one or more right-hand sides and replaces them by the solutions. **Shapes** `n × k`, column by column.
    ///
    /// # Panics
    /// If the length is not a multiple of [`size`](Self::size).
    pub fn solve_in_place(&self, columns: &mut [f64]) {
        if self.size == 0 {
            return;
        }
        assert_eq!(columns.len() % self.size, 0, "columns of a matrix of {} rows", self.size);
        let count = columns.len() / self.size;
        self.factor.solve_in_place(MatMut::from_column_major_slice_mut(columns, self.size, count));
    }

    /// Solves for one right-hand side. **Shapes** `n`.
    pub fn solve(&self, right: &[f64]) -> Vec<f64> {
        let mut column = right.to_vec();
        self.solve_in_place(&mut column);
        column
    }

    /// Solves for the three coordinates of vectors. **Shapes** `n × 3`.
    pub fn solve_vectors(&self, right: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let mut columns: Vec<f64> = (0..3).flat_map(|axis| right.iter().map(move |v| v[axis])).collect();
        self.solve_in_place(&mut columns);
        let n = self.size;
        (0..n).map(|i| Vector3::new(columns[i], columns[n + i], columns[2 * n + i])).collect()
    }
}

fn factorise(
    size: usize,
    pattern: &SymbolicSparseColMat<usize>,
    order: &Argsort<usize>,
    symbolic: &SymbolicLlt<usize>,
    lower: &[usize],
    values: &[f64],
) -> Result<Llt<usize, f64>, NumericsError> {
    if let Some(index) = values.iter().position(|v| !v.is_finite()) {
        return Err(NumericsError::NotFinite { what: "values of the matrix", index });
    }
    let values: Vec<f64> = lower.iter().map(|&i| values[i]).collect();
    let matrix = SparseColMat::new_from_argsort(pattern.clone(), order, &values)
        .map_err(|_| NumericsError::OutOfMemory { size })?;
    Llt::try_new_with_symbolic(symbolic.clone(), matrix.as_ref(), Side::Lower).map_err(|error| match error {
        LltError::Numeric(faer::linalg::cholesky::llt::factor::LltError::NonPositivePivot { index }) => {
            NumericsError::NotPositiveDefinite { size, pivot: index }
        }
        LltError::Generic(_) => NumericsError::OutOfMemory { size },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The Laplacian of a ring with a chord from each node, plus `shift` on the diagonal; duplicates on purpose.
    fn ring(n: usize, shift: f64) -> Vec<(usize, usize, f64)> {
        let mut triplets = Vec::new();
        for i in 0..n {
            for j in [(i + 1) % n, (i * 7 + 3) % n] {
                if i != j {
                    triplets.extend([(i, j, -1.0), (j, i, -1.0), (i, i, 1.0), (j, j, 1.0)]);
                }
            }
            triplets.push((i, i, shift));
        }
        triplets
    }

    fn times(n: usize, triplets: &[(usize, usize, f64)], x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; n];
        for &(i, j, v) in triplets {
            product[i] += v * x[j];
        }
        product
    }

    #[test]
    fn the_solution_solves_and_refactoring_equals_preparing() {
        let n = 200;
        let x: Vec<f64> = (0..2 * n).map(|i| (i as f64 * 0.7).sin()).collect();
        let (first, second) = (ring(n, 0.1), ring(n, 3.0));
        let mut factor = SparseCholesky::prepare(n, &first).unwrap();
        for triplets in [&first, &second] {
            factor.refactor(&triplets.iter().map(|t| t.2).collect::<Vec<_>>()).unwrap();
            let mut columns = [times(n, triplets, &x[..n]), times(n, triplets, &x[n..])].concat();
            factor.solve_in_place(&mut columns);
            assert!(columns.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-10));
        }
        let fresh = SparseCholesky::prepare(n, &second).unwrap();
        let right: Vec<Vector3<f64>> = (0..n).map(|i| Vector3::new(i as f64, 1.0, -(i as f64))).collect();
        assert_eq!(fresh.solve_vectors(&right), factor.solve_vectors(&right));
    }

    #[test]
    fn what_cannot_be_factorised_is_said() {
        let singular = SparseCholesky::prepare(3, &[(0, 0, 1.0), (1, 1, 1.0), (2, 2, 0.0)]);
        assert!(matches!(singular.err(), Some(NumericsError::NotPositiveDefinite { size: 3, .. })));
        let outside = SparseCholesky::prepare(2, &[(5, 0, 1.0)]);
        assert_eq!(outside.err(), Some(NumericsError::OutOfRange { row: 5, column: 0, size: 2 }));
        let nan = SparseCholesky::prepare(1, &[(0, 0, f64::NAN)]);
        assert_eq!(nan.err(), Some(NumericsError::NotFinite { what: "values of the matrix", index: 0 }));
        let mut good = SparseCholesky::prepare(1, &[(0, 0, 4.0)]).unwrap();
        assert!(matches!(good.refactor(&[]), Err(NumericsError::WrongLength { given: 0, expected: 1, .. })));
        assert_eq!(good.solve(&[8.0]), vec![2.0]);
    }

    #[test]
    fn no_unknowns_have_an_empty_solution() {
        let empty = SparseCholesky::prepare(0, &[]).unwrap();
        assert!(empty.solve(&[]).is_empty());
    }
}
