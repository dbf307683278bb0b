//! The robust weight of a residual.

use super::posed::Residual;

/// Residual scale in metres: about the noise of a depth camera at 2 m, and the residual of a 15-component model.
const SIGMA: f64 = 0.005;

/// Area of one observation, in square metres.
const AREA_PER_OBSERVATION: f64 = 4e-4;

/// The number of observations in `area`, over σ², times a Geman–McClure kernel that falls to almost nothing at `reach`.
pub(crate) fn robust(area: f64, distance: f64, reach: f64) -> f64 {
    let scale = 0.4 * reach;
    let kernel = 1.0 / (1.0 + (distance / scale).powi(2)).powi(2);
    area / AREA_PER_OBSERVATION / (SIGMA * SIGMA) * kernel
}

/// Weighted mean of the absolute gaps.
pub(crate) fn mean_residual(residuals: &[Residual]) -> f64 {
    let (sum, total) =
        residuals.iter().fold((0.0, 0.0), |(sum, total), r| (sum + r.weight * r.gap.abs(), total + r.weight));
    sum / f64::max(total, 1e-12)
}
