//! How a fit inside a scan went.

use crate::body::JointId;
use crate::fit::confidence::{CONFIDENT, doubt};
use serde::{Deserialize, Serialize};

/// How a fit inside a scan went. Lengths are metres.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct InsideReport {
    /// Whether the last iterations moved no joint by more than the threshold.
    pub converged: bool,
    /// Iterations taken.
    pub iterations: usize,
    /// Mean distance from the visible part of the figure to the scan.
    pub residual_mean: f64,
    /// 95th percentile of the distance from the visible part of the figure to the scan.
    pub residual_p95: f64,
    /// Area share of the hidden skin that is outside the scan.
    pub outside_share: f64,
    /// Greatest depth of hidden skin outside the scan.
    pub outside_depth: f64,
    /// Mean move of the joints from the previous step's pose, in the root's frame.
    pub joint_change: f64,
    /// Mean distance of the skin, offsets included, from where the previous step's pose has it, in the root's frame.
    pub proximity: f64,
    /// 0 to 1: `explained_share · seen_share · (1 − outside_share)`.
    pub confidence: f64,
    /// Area share of the scan that lies on the figure, or within the stand-off of its cloth.
    pub explained_share: f64,
    /// Area share of the figure's visible surface that lies on the scan.
    pub seen_share: f64,
    /// Limbs that the scan does not show, each by the joint at which it begins; they keep the previous step's pose.
    pub unseen: Vec<JointId>,
    /// Whether the scan shows the head.
    pub head_is_seen: bool,
    /// Events and warnings, one per line.
    pub log: Vec<String>,
}

impl InsideReport {
    /// Whether the fit converged and the scan supports it. If not, the log says why.
    pub fn is_confident(&self) -> bool {
        self.converged && self.confidence >= CONFIDENT
    }

    /// Adds a warning to the log if the confidence is low.
    pub(super) fn with_doubt(mut self) -> Self {
        self.log.extend(doubt(self.confidence, self.explained_share, self.seen_share, Some(self.outside_share)));
        self
    }
}
