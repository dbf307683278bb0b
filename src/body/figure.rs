//! The figure: a skeleton with the surfaces it wears.

use super::{Pose, Skeleton, SkinWeights, UvMap, skin};
use crate::geometry::{PerVertex, TriMesh};
use serde::{Deserialize, Serialize};

/// One skinned surface of a figure, in the bind pose.
///
/// **Shapes** every attribute but `uvs` has one entry per vertex of `mesh`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Layer {
    /// `body`, or the garment's name in the session.
    pub name: String,
    /// The garment kind (file stem of its template); `None` for the body.
    pub template: Option<String>,
    /// Surface in the bind pose.
    pub mesh: TriMesh,
    /// Skin weights.
    pub weights: SkinWeights,
    /// Colours as scanned.
    pub colors: Option<PerVertex<[u8; 3]>>,
    /// Texture coordinates, and the picture where one was baked.
    pub uvs: Option<UvMap>,
    /// Share of cloth physics in the motion of each vertex, 0–0.5 (Hu 2017, Eq. 9); `None` if nothing is simulated.
    pub physics: Option<PerVertex<f64>>,
    /// Fabric preset.
    pub fabric: Option<String>,
}

/// A skeleton with its skinned surfaces, innermost first; layer 0 is the body.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figure {
    /// Joints in the bind pose.
    pub skeleton: Skeleton,
    /// One surface per layer, innermost first.
    pub layers: Vec<Layer>,
}

impl Figure {
    /// A body without garments.
    pub fn bare(skeleton: Skeleton, mesh: TriMesh, weights: SkinWeights) -> Self {
        Self { skeleton, layers: vec![Layer::plain("body", mesh, weights)] }
    }

    /// The innermost surface.
    pub fn body(&self) -> &Layer {
        &self.layers[0]
    }

    /// The garments, innermost first.
    ///
    /// **Shapes** one entry per layer but the body.
    pub fn garments(&self) -> &[Layer] {
        &self.layers[1..]
    }

    /// Every surface skinned into `pose`.
    ///
    /// **Shapes** one mesh per layer, in the order of `layers`.
    pub fn posed(&self, pose: &Pose) -> Vec<TriMesh> {
        self.layers.iter().map(|layer| layer.posed(&self.skeleton, pose)).collect()
    }
}

impl Layer {
    /// A surface with nothing but skin weights.
    pub fn plain(name: &str, mesh: TriMesh, weights: SkinWeights) -> Self {
        Self { name: name.into(), template: None, mesh, weights, colors: None, uvs: None, physics: None, fabric: None }
    }

    /// This surface skinned into `pose`.
    pub fn posed(&self, skeleton: &Skeleton, pose: &Pose) -> TriMesh {
        self.mesh.with_points(skin(self.mesh.points(), &self.weights, skeleton, pose))
    }
}
