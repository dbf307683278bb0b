//! Constraint violation: skin that neither the pose nor the bounded offset brings inside the scan.

use super::required_offset::RequiredOffset;
use crate::body::{Skeleton, SkinWeights, dominant_body_joint};
use crate::geometry::{PerVertex, VertexId};

/// By how much, and where, the margin is violated after the offset.
pub(crate) struct ConstraintViolation {
    /// Area share of the constrained skin that is outside the scan.
    pub(crate) outside_share: f64,
    /// Greatest depth outside the scan, in metres.
    pub(crate) outside_depth: f64,
    /// Area share of the constrained skin that violates the margin, and its greatest violation in metres.
    share: f64,
    depth: f64,
    /// How far skin would still have to move in along its normal, which may be oblique to the scan: only
    /// [`SPOT_SHARE`] of the constrained skin has to move further, in metres. Limbs in a wrong place have far to move and
    /// little depth.
    pub(crate) spot_depth: f64,
    deepest: Option<VertexId>,
}

/// A share of the skin that is larger than any membrane or stray vertex: 15 cm² of an adult.
const SPOT_SHARE: f64 = 0.001;

impl ConstraintViolation {
    /// Measures the violation of all body vertices that have an area.
    ///
    /// **Shapes** `areas`, `required` and `offsets` have one entry per body vertex.
    pub(crate) fn of(
        areas: &PerVertex<f64>,
        required: &PerVertex<Option<RequiredOffset>>,
        offsets: &PerVertex<f64>,
        margin: impl Fn(VertexId) -> f64,
    ) -> Self {
        let (mut constrained, mut violating, mut outside) = (0.0, 0.0, 0.0);
        let (mut depth, mut deepest) = (0.0, None);
        let mut outside_depth = 0.0_f64;
        let mut ways: Vec<(f64, f64)> = Vec::new();
        for (v, required) in required.enumerate().filter(|(v, _)| areas[*v] > 0.0) {
            let Some(required) = required else { continue };
            constrained += areas[v];
            let violation = required.violation(offsets[v]);
            if violation > 1e-6 {
                violating += areas[v];
                ways.push((required.along_normal + offsets[v], areas[v]));
            }
            let outside_by = violation - margin(v);
            if outside_by > 0.0 {
                outside += areas[v];
                outside_depth = outside_depth.max(outside_by);
            }
            if violation > f64::max(depth, 1e-6) {
                (depth, deepest) = (violation, Some(v));
            }
        }
        ways.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut left = SPOT_SHARE * constrained;
        let spot = ways.iter().find(|(_, area)| {
            left -= area;
            left < 0.0
        });
        let spot_depth = spot.map_or(0.0, |s| s.0);
        let share_of = |area: f64| if constrained > 0.0 { area / constrained } else { 0.0 };
        let (share, outside_share) = (share_of(violating), share_of(outside));
        Self { outside_share, outside_depth, share, depth, spot_depth, deepest }
    }

    /// The part of the body where the violation is greatest.
    pub(crate) fn near(&self, skeleton: &Skeleton, weights: &SkinWeights) -> Option<String> {
        let joint = dominant_body_joint(&weights.rows()[self.deepest?], &skeleton.body_joints());
        Some(skeleton.part_name(joint))
    }

    /// One sentence if the margin is violated.
    pub(crate) fn summary(&self, skeleton: &Skeleton, weights: &SkinWeights) -> Option<String> {
        /// Smaller violations are not reported: a tenth of a scanner's noise. Metres.
        const LEAST_REPORTED: f64 = 2e-4;
        let near = self.near(skeleton, weights).filter(|_| self.depth > LEAST_REPORTED)?;
        Some(format!(
            "{:.2} % of the hidden skin is up to {:.1} mm too close to the scan, most of it at the {near}: the scan is smaller there",
            self.share * 100.0,
            self.depth * 1e3,
        ))
    }
}
