//! Where the scan is smaller than the figure: what neither pose nor offset can bring inside.

use super::required_offset::Need;
use crate::body::{Skeleton, SkinWeights};
use crate::fit::correspondence::spoken;
use crate::geometry::{PerVertex, VertexId};

/// What even with the offset does not keep the margin.
pub(crate) struct Lack {
    /// Area share of the constrained skin that lies outside the scan.
    pub(crate) outside_share: f64,
    /// Greatest depth outside it, in metres.
    pub(crate) outside_depth: f64,
    /// Area share of the constrained skin that does not keep the margin, and its greatest lack in metres.
    share: f64,
    depth: f64,
    /// How far skin would still have to go in along its normal, which the scan may face askew: the way beyond which lies
    /// [`A_SPOT`] of the constrained skin, in metres. Limbs that lie elsewhere have long ways and little depth.
    pub(crate) depth_of_spot: f64,
    deepest: Option<VertexId>,
}

/// A share of the skin that no membrane or stray vertex makes: 15 cm² of a grown-up.
const A_SPOT: f64 = 0.001;

impl Lack {
    /// Of vertices with an area.
    pub(crate) fn of(
        areas: &PerVertex<f64>,
        needed: &PerVertex<Option<Need>>,
        offsets: &PerVertex<f64>,
        margin: impl Fn(VertexId) -> f64,
    ) -> Self {
        let (mut constrained, mut lacking, mut outside) = (0.0, 0.0, 0.0);
        let (mut depth, mut deepest) = (0.0, None);
        let mut outside_depth = 0.0_f64;
        let mut ways: Vec<(f64, f64)> = Vec::new();
        for (v, need) in needed.enumerate().filter(|(v, _)| areas[*v] > 0.0) {
            let Some(need) = need else { continue };
            constrained += areas[v];
            let lack = need.lack(offsets[v]);
            if lack > 1e-6 {
                lacking += areas[v];
                ways.push((need.along_normal + offsets[v], areas[v]));
            }
            let beyond = lack - margin(v);
            if beyond > 0.0 {
                outside += areas[v];
                outside_depth = outside_depth.max(beyond);
            }
            if lack > f64::max(depth, 1e-6) {
                (depth, deepest) = (lack, Some(v));
            }
        }
        ways.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut left = A_SPOT * constrained;
        let spot = ways.iter().find(|(_, area)| {
            left -= area;
            left < 0.0
        });
        let depth_of_spot = spot.map_or(0.0, |s| s.0);
        let share_of = |area: f64| if constrained > 0.0 { area / constrained } else { 0.0 };
        let (share, outside_share) = (share_of(lacking), share_of(outside));
        Self { outside_share, outside_depth, share, depth, depth_of_spot, deepest }
    }

    /// Where most of it is.
    pub(crate) fn near(&self, skeleton: &Skeleton, weights: &SkinWeights) -> Option<String> {
        let joint = weights.rows()[self.deepest?][0].0;
        Some(spoken(&skeleton.names[joint.index()]))
    }

    /// A sentence where there is a lack.
    pub(crate) fn told(&self, skeleton: &Skeleton, weights: &SkinWeights) -> Option<String> {
        /// A tenth of a scanner's noise. Metres.
        const WORTH_SAYING: f64 = 2e-4;
        let near = self.near(skeleton, weights).filter(|_| self.depth > WORTH_SAYING)?;
        Some(format!(
            "{:.2} % of the hidden skin lacks up to {:.1} mm of the margin, most of it at the {near}: the scan is smaller there",
            self.share * 100.0,
            self.depth * 1e3,
        ))
    }
}
