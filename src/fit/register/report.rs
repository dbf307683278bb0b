//! How a registration went.

use serde::{Deserialize, Serialize};

/// How a registration went. Lengths are metres.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RegistrationReport {
    /// Whether `last_move` is below [`CONVERGED_BELOW`](Self::CONVERGED_BELOW).
    pub converged: bool,
    /// Iterations taken.
    pub iterations: usize,
    /// Mean distance of the registered vertices from the scan, where the scan is near.
    pub residual_mean: f64,
    /// 95th percentile of the distance of the registered vertices from the scan.
    pub residual_p95: f64,
    /// Root mean square move of the vertices, by area, in the last iteration.
    pub last_move: f64,
    /// Events and warnings, one per line.
    pub log: Vec<String>,
}

impl RegistrationReport {
    /// A registration has converged if its last iteration moves the surface by less than this: root mean square in metres, far
    /// below a scanner's noise. The scan of a whole man ends at 0.06 mm with the default parameters.
    pub const CONVERGED_BELOW: f64 = 3e-4;
}
