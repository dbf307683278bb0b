//! What a registration results in.

use crate::body::{Pose, Skeleton, UvMap};
use crate::fit::report::FitReport;
use crate::geometry::{PerVertex, TriMesh};
use serde::{Deserialize, Serialize};

/// The template moved onto the naked scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegisteredBody {
    /// Surface in the bind pose, with the model's vertices.
    pub surface: TriMesh,
    /// Skeleton inside that surface.
    pub skeleton: Skeleton,
    /// Pose in the naked scan: skinning `surface` with it gives the registered surface in the scan's frame.
    pub pose: Pose,
    /// Colours taken from the scan.
    pub colors: Option<PerVertex<[u8; 3]>>,
    /// The model's texture coordinates with the scan's colours baked into a picture, where both have them.
    pub uvs: Option<UvMap>,
    /// How it went.
    pub report: FitReport,
}
