//! What a naked fit results in.

use crate::body::{BodyModel, Figure, JointId, Pose, Shape, Skeleton};
use crate::fit::report::FitReport;
use crate::geometry::TriMesh;
use serde::{Deserialize, Serialize};

/// A model fitted to a naked scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedBody {
    /// β.
    pub shape: Shape,
    /// θ and the root, in the scan's frame.
    pub pose: Pose,
    /// The model's surface of that shape, in the bind pose.
    pub surface: TriMesh,
    /// Its skeleton.
    pub skeleton: Skeleton,
    /// Limbs that the scan does not show, each by the joint at which it begins.
    pub unseen: Vec<JointId>,
    /// Where all scans of a session made the shape: how the person stands in each of the others, in their order and in their
    /// frames; `None` for those that took no part.
    pub poses_in_others: Vec<Option<Pose>>,
    /// How it went.
    pub report: FitReport,
}

impl FittedBody {
    /// The body alone, as it was fitted; `model` is what was fitted.
    pub fn figure(&self, model: &BodyModel) -> Figure {
        Figure::bare(self.skeleton.clone(), self.surface.clone(), model.weights.clone())
    }
}
