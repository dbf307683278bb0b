//! The figure: a skeleton with the surfaces it wears.

use super::{BodyModel, HumanJoint, JointId, Pose, Skeleton, SkinRow, SkinWeights, Skinning, UvMap, skin};
use crate::geometry::{PerFace, PerVertex, Point, TriMesh, Vec3, VertexId};
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
    /// Which vertices the scan showed; `None` if all. The others were filled or continue below another layer.
    pub is_seen: Option<PerVertex<bool>>,
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
    /// The mean body of a model, without garments.
    pub fn mean(model: &BodyModel) -> Self {
        Self::bare(model.skeleton.clone(), model.template.clone(), model.weights.clone())
    }

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

    /// Whether a garment is footwear: at least half of its vertices follow the feet.
    pub fn is_footwear(&self, layer: &Layer) -> bool {
        const OF_FEET: f64 = 0.5;
        let is_foot =
            |j: JointId| matches!(self.skeleton.human_joint(j), Some(HumanJoint::Foot(_) | HumanJoint::Toes(_)));
        let rows = layer.weights.rows();
        let of_feet = |row: &&SkinRow| row.iter().filter(|(j, _)| is_foot(*j)).map(|(_, w)| w).sum::<f64>() > 0.5;
        rows.iter().filter(of_feet).count() as f64 >= OF_FEET * rows.len().max(1) as f64
    }

    /// The figure moved up by so many metres.
    pub fn raised(&self, by: f64) -> Self {
        let up = |p: &Point| p + Vec3::y() * by;
        let mut raised = self.clone();
        raised.skeleton.joints_in_bind.iter_mut().for_each(|p| *p = up(p));
        for layer in &mut raised.layers {
            layer.mesh = layer.mesh.map_points(up);
        }
        raised
    }

    /// Every surface skinned into `pose`.
    ///
    /// **Shapes** one mesh per layer, in the order of `layers`.
    pub fn posed(&self, pose: &Pose) -> Vec<TriMesh> {
        self.posed_by(Skinning::Linear, pose)
    }

    /// Every surface skinned into `pose` in the given way.
    ///
    /// **Shapes** one mesh per layer, in the order of `layers`.
    pub fn posed_by(&self, skinning: Skinning, pose: &Pose) -> Vec<TriMesh> {
        let posed = |layer: &Layer| {
            layer.mesh.with_points(skinning.skin(layer.mesh.points(), &layer.weights, &self.skeleton, pose))
        };
        self.layers.iter().map(posed).collect()
    }
}

impl Layer {
    /// A surface with nothing but skin weights.
    pub fn plain(name: &str, mesh: TriMesh, weights: SkinWeights) -> Self {
        Self {
            name: name.into(),
            template: None,
            mesh,
            weights,
            colors: None,
            is_seen: None,
            uvs: None,
            physics: None,
            fabric: None,
        }
    }

    /// The faces marked in `keep`, with only the vertices that they use and all their attributes.
    ///
    /// Returns the part and, for each of its vertices, the vertex of `self` that it was.
    ///
    /// **Shapes** `keep` F; the map has one entry per vertex of the part.
    ///
    /// **Requires** attributes for every vertex and face.
    ///
    /// # Panics
    /// If there is not one flag per face.
    pub fn part(&self, keep: &PerFace<bool>) -> (Self, PerVertex<VertexId>) {
        let (mesh, kept) = self.mesh.part(keep);
        let part = Self {
            name: self.name.clone(),
            template: self.template.clone(),
            mesh,
            weights: self.weights.of_vertices(&kept),
            colors: self.colors.as_ref().map(|colors| kept.iter().map(|&v| colors[v]).collect()),
            is_seen: self.is_seen.as_ref().map(|is_seen| kept.iter().map(|&v| is_seen[v]).collect()),
            uvs: self.uvs.as_ref().map(|uvs| uvs.part(keep)),
            physics: self.physics.as_ref().map(|physics| kept.iter().map(|&v| physics[v]).collect()),
            fabric: self.fabric.clone(),
        };
        (part, kept)
    }

    /// This surface skinned into `pose`.
    pub fn posed(&self, skeleton: &Skeleton, pose: &Pose) -> TriMesh {
        self.mesh.with_points(skin(self.mesh.points(), &self.weights, skeleton, pose))
    }
}
