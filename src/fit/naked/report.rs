//! How a naked fit went.

use crate::fit::confidence::{CONFIDENT, doubt};
use serde::{Deserialize, Serialize};

/// How a naked fit went. Lengths are metres.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NakedReport {
    /// Whether the last iterations moved no joint by more than the threshold.
    pub converged: bool,
    /// Iterations taken.
    pub iterations: usize,
    /// Mean distance from the scan to the fitted surface.
    pub residual_mean: f64,
    /// 95th percentile of the distance from the scan to the fitted surface.
    pub residual_p95: f64,
    /// 0 to 1: `explained_share · seen_share`.
    pub confidence: f64,
    /// Area share of the scan that lies on the fitted surface.
    pub explained_share: f64,
    /// Area share of the fitted surface that lies on the scan.
    pub seen_share: f64,
    /// Whether the scan shows the head; if not, the head is the model's.
    pub head_is_seen: bool,
    /// Events and warnings, one per line.
    pub log: Vec<String>,
}

impl NakedReport {
    /// Whether the fit converged and the scan supports it. If not, the log says why.
    pub fn is_confident(&self) -> bool {
        self.converged && self.confidence >= CONFIDENT
    }

    /// Adds a warning to the log if the confidence is low.
    pub(super) fn with_doubt(mut self) -> Self {
        self.log.extend(doubt(self.confidence, self.explained_share, self.seen_share, None));
        self
    }
}
