//! Eigenvalues of symmetric matrices.

use faer::{Mat, Side};

/// The eigenvalues of a symmetric matrix, ascending, with their unit eigenvectors.
pub struct SymmetricEigen {
    /// **Shapes** `N`, ascending.
    pub values: Vec<f64>,
    /// **Shapes** `N × N`: row `k` is the unit eigenvector of `values[k]`. Its sign is arbitrary.
    pub vectors: Vec<Vec<f64>>,
}

/// The decomposition of a symmetric matrix given by its lower triangle; `None` if it does not converge, as with an
/// entry that is not a number.
///
/// **Shapes** `lower` `N` rows; row `i` holds columns `0..=i`.
///
/// # Panics
/// If row `i` has fewer than `i + 1` entries.
pub fn symmetric_eigen(lower: &[Vec<f64>]) -> Option<SymmetricEigen> {
    let n = lower.len();
    let matrix = Mat::<f64>::from_fn(n, n, |i, j| lower[i.max(j)][i.min(j)]);
    let eigen = matrix.self_adjoint_eigen(Side::Lower).ok()?;
    Some(SymmetricEigen {
        values: (0..n).map(|k| eigen.S()[k]).collect(),
        vectors: (0..n).map(|k| (0..n).map(|i| eigen.U()[(i, k)]).collect()).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_vector_is_stretched_by_its_value() {
        let lower = vec![vec![4.0], vec![1.0, 3.0], vec![-2.0, 0.5, 5.0]];
        let full = |i: usize, j: usize| lower[i.max(j)][i.min(j)];
        let found = symmetric_eigen(&lower).unwrap();
        assert!(found.values.is_sorted(), "{:?}", found.values);
        assert!((found.values.iter().sum::<f64>() - 12.0).abs() < 1e-12, "the trace: {:?}", found.values);
        for (value, vector) in found.values.iter().zip(&found.vectors) {
            assert!((vector.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
            for i in 0..3 {
                let mapped: f64 = (0..3).map(|j| full(i, j) * vector[j]).sum();
                assert!((mapped - value * vector[i]).abs() < 1e-12, "{value}: row {i}");
            }
        }
    }
}
