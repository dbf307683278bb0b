//! What a registration results in.

use super::report::RegistrationReport;
use crate::body::{Pose, Skeleton, UvMap};
use crate::geometry::{PerVertex, TriMesh};
use serde::{Deserialize, Serialize};

/// The template registered to the naked scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegisteredBody {
    /// Surface in the bind pose, with the model's vertices and faces. **Shapes** `V × 3`.
    pub surface: TriMesh,
    /// Skeleton inside that surface.
    pub skeleton: Skeleton,
    /// Pose in the naked scan: skinning `surface` with it gives the registered surface in the scan's frame.
    pub pose: Pose,
    /// Colours taken from the scan, one per vertex; `None` for a scan without colours.
    pub colors: Option<PerVertex<[u8; 3]>>,
    /// The model's texture coordinates, with a texture baked from the scan's colours if both exist.
    pub uvs: Option<UvMap>,
    /// How the registration went.
    pub report: RegistrationReport,
}
