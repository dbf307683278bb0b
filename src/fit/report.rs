//! How a fit went.

use serde::{Deserialize, Serialize};

/// How a fit went. Lengths are metres.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FitReport {
    /// Whether the last iterations changed next to nothing.
    pub converged: bool,
    /// Iterations taken.
    pub iterations: usize,
    /// Mean distance from the scan's data to the fitted surface.
    pub residual_mean: f64,
    /// 95th percentile of the same.
    pub residual_p95: f64,
    /// Share of the constrained area that lies outside the scan; 0 for a naked fit.
    pub outside_share: f64,
    /// Greatest depth outside the scan over the constrained area.
    pub outside_depth: f64,
    /// Mean move of the joints from the previous step's pose, as seen from the root; 0 for a naked fit.
    pub joint_change: f64,
    /// Mean distance of the body's skin, with its offsets, from where the previous step's pose has it, as seen from the root; 0
    /// for a naked fit.
    pub proximity: f64,
    /// 0 to 1: the share of the scan that the body explains times the share of the body that the scan shows. For a figure
    /// inside a scan, both over what should show, times the share of the hidden skin that is inside.
    pub confidence: f64,
    /// Area share of the scan that lies on the fitted surface; 0 where it was not looked at.
    pub explained_share: f64,
    /// Area share of the fitted surface, as far as it should show, that lies on the scan.
    pub seen_share: f64,
    /// One line an important turn.
    pub log: Vec<String>,
}

impl FitReport {
    /// A converged fit is given out without a word from here on: whole scans come to 0.87 and more, half a person to 0.5.
    pub const CONFIDENT: f64 = 0.75;

    /// Whether the fit came to rest and the scan bears it out; a report that is not confident says why in its log.
    pub fn is_confident(&self) -> bool {
        self.converged && self.confidence >= Self::CONFIDENT
    }

    /// The same with a sentence of what makes it doubtful, where it is.
    pub(crate) fn doubted(mut self) -> Self {
        if self.confidence < Self::CONFIDENT {
            let percent = |share: f64| 100.0 * share;
            let [explained, seen, outside] = [self.explained_share, self.seen_share, self.outside_share].map(percent);
            let outside =
                if outside > 0.5 { format!(", {outside:.0} % of the hidden skin outside it") } else { String::new() };
            self.log.push(format!(
                "doubtful (confidence {:.2}): {explained:.0} % of the scan is the figure, {seen:.0} % of what should show of the figure is in the scan{outside}; look at hands and feet",
                self.confidence,
            ));
        }
        self
    }
}
