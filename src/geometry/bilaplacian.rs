//! Screened smoothing with a bending energy (the bilaplacian).

use super::laplacian::Laplacian;

/// Least mass of a vertex whose inverse is taken, as a share of the mean mass: otherwise the slivers of fused scans, and
/// vertices without faces, outweigh all others.
const LEAST_MASS_PER_MEAN: f64 = 0.1;

impl Laplacian {
    /// The mass of each vertex, bounded away from zero so that it can be inverted.
    ///
    /// **Shapes** one entry per vertex, in m².
    pub fn safe_mass(&self) -> Vec<f64> {
        let count = self.mass.len().max(1) as f64;
        let least = (self.mass.iter().sum::<f64>() / count * LEAST_MASS_PER_MEAN).max(f64::MIN_POSITIVE);
        self.mass.iter().map(|m| m.max(least)).collect()
    }

    /// `diag(weights · M) + harmonic · L + biharmonic · L M⁻¹ L`: the lower triangle and diagonal of the
    /// matrix of a screened smoothing, as [`SparseCholesky`](crate::numerics::SparseCholesky) takes it.
    ///
    /// With weights of 1, `harmonic = ℓ₁²` and `biharmonic = ℓ₂⁴`, values are smoothed over lengths of about `ℓ₁` and `ℓ₂`.
    ///
    /// # Panics
    /// If there is not one weight per vertex.
    ///
    /// **Requires** weights ≥ 0, and > 0 somewhere in each connected part.
    pub fn screened(&self, weights: &[f64], harmonic: f64, biharmonic: f64) -> Vec<(usize, usize, f64)> {
        let count = self.mass.len();
        assert_eq!(weights.len(), count, "one weight per vertex");
        let mass = self.safe_mass();
        let mut rows: Vec<Vec<(usize, f64)>> = vec![Vec::with_capacity(8); count];
        for &(row, column, value) in &self.triplets {
            rows[row].push((column, value));
        }
        let mut sum = vec![0.0; count];
        let mut seen: Vec<usize> = Vec::with_capacity(64);
        let mut is_seen = vec![false; count];
        let mut lower = Vec::with_capacity(count * 12);
        for i in 0..count {
            let mut add = |j: usize, value: f64| {
                if j <= i {
                    if !is_seen[j] {
                        is_seen[j] = true;
                        seen.push(j);
                    }
                    sum[j] += value;
                }
            };
            add(i, weights[i] * mass[i]);
            for &(k, value) in &rows[i] {
                add(k, harmonic * value);
                if biharmonic > 0.0 {
                    let factor = biharmonic * value / mass[k];
                    for &(j, other) in &rows[k] {
                        add(j, factor * other);
                    }
                }
            }
            seen.sort_unstable();
            for j in seen.drain(..) {
                lower.push((i, j, sum[j]));
                sum[j] = 0.0;
                is_seen[j] = false;
            }
        }
        lower
    }
}

#[cfg(test)]
mod tests {
    use crate::geometry::cotangent_laplacian;
    use crate::geometry::shapes_for_tests::sphere;

    #[test]
    fn the_screened_matrix_equals_its_definition() {
        let laplacian = cotangent_laplacian(&sphere(8, 12));
        let n = laplacian.mass.len();
        let mass = laplacian.safe_mass();
        let weights: Vec<f64> = (0..n).map(|i| 0.1 + (i % 3) as f64).collect();
        let x: Vec<f64> = (0..n).map(|i| (i as f64 * 0.37).sin()).collect();
        let (harmonic, biharmonic) = (0.7, 0.2);
        let mut product = vec![0.0; n];
        for (i, j, value) in laplacian.screened(&weights, harmonic, biharmonic) {
            assert!(j <= i);
            product[i] += value * x[j];
            if i != j {
                product[j] += value * x[i];
            }
        }
        let once = laplacian.apply(&x);
        let twice = laplacian.apply(&once.iter().zip(&mass).map(|(v, m)| v / m).collect::<Vec<_>>());
        for i in 0..n {
            let expected = weights[i] * mass[i] * x[i] + harmonic * once[i] + biharmonic * twice[i];
            assert!((product[i] - expected).abs() < 1e-9 * expected.abs().max(1.0));
        }
    }
}
