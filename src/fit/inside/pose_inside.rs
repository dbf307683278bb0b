//! What a fit inside a scan results in.

use super::report::InsideReport;
use crate::body::Pose;
use crate::geometry::PerVertex;
use serde::{Deserialize, Serialize};

/// The pose of a figure inside the next scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseInside {
    /// θ and the root, in the scan's frame.
    pub pose: Pose,
    /// Offset along the posed body's normals that makes up for what the pose cannot satisfy: metres, ≤ 0, bounded and
    /// smooth. **Shapes** one value per vertex of the body.
    pub offsets: PerVertex<f64>,
    /// How the fit went.
    pub report: InsideReport,
}

impl PoseInside {
    /// Offsets skin inward at least as far as an earlier step did, so that it stays inside the garment of that step.
    pub fn offset_inward_as(mut self, before: &Self) -> Self {
        self.offsets
            .0
            .iter_mut()
            .zip(before.offsets.iter())
            .for_each(|(offset, earlier)| *offset = offset.min(*earlier));
        self
    }
}
