//! What a fit inside a scan results in.

use crate::body::Pose;
use crate::fit::report::FitReport;
use crate::geometry::PerVertex;
use serde::{Deserialize, Serialize};

/// The figure dressed so far inside the next scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseInside {
    /// θ and the root, in the scan's frame.
    pub pose: Pose,
    /// What pose could not satisfy: metres along the posed body's normals, one a vertex of the body (bounded, smooth).
    pub offsets: PerVertex<f64>,
    /// How it went.
    pub report: FitReport,
}

impl PoseInside {
    /// Draws skin in at least as far as an earlier step did: what lay inside a garment then still lies inside it now, though
    /// the scan shows another one.
    pub fn offset_inward_as(mut self, before: &Self) -> Self {
        self.offsets
            .0
            .iter_mut()
            .zip(before.offsets.iter())
            .for_each(|(offset, earlier)| *offset = offset.min(*earlier));
        self
    }
}
