//! What a naked fit results in.

use super::hair::Hair;
use super::report::NakedReport;
use crate::body::{BodyModel, Figure, JointId, Pose, Shape, Skeleton};
use crate::geometry::{PerVertex, TriMesh};
use crate::scan::Scan;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// A model fitted to a naked scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedBody {
    /// β. **Shapes** one coefficient per component of the model.
    pub shape: Shape,
    /// θ and the root, in the scan's frame.
    pub pose: Pose,
    /// The model's surface of that shape, in the bind pose.
    pub surface: TriMesh,
    /// The skeleton of that shape.
    pub skeleton: Skeleton,
    /// Limbs that the scan does not show, each by the joint at which it begins.
    pub unseen: Vec<JointId>,
    /// If all scans of a session determine the shape: the pose in each of the other scans, in their order and frames, `None`
    /// for a scan that is not used. Empty otherwise. **Shapes** one entry per other scan.
    pub poses_in_others: Vec<Option<Pose>>,
    /// How the fit went.
    pub report: NakedReport,
    /// How far each place of the surface may be off along its normal, as a standard deviation in metres; only of a body that was
    /// estimated below clothes. **Shapes** one entry per vertex.
    pub deviation: Option<PerVertex<f64>>,
    /// Hair that the scan shows and that is no part of the body; `None` without hair, or if it counts as part of the body.
    pub hair: Option<Hair>,
}

impl FittedBody {
    /// The naked scan without what is no part of the body: hair.
    ///
    /// # Panics
    /// If `scan` is not the scan that was fitted.
    pub fn bare_part<'s>(&self, scan: &'s Scan) -> Cow<'s, Scan> {
        self.hair.as_ref().map_or(Cow::Borrowed(scan), |hair| Cow::Owned(hair.removed_from(scan)))
    }

    /// The fitted body as a figure without garments; `model` is the model that was fitted.
    pub fn figure(&self, model: &BodyModel) -> Figure {
        Figure::bare(self.skeleton.clone(), self.surface.clone(), model.weights.clone())
    }
}
