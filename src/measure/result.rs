//! The results of a session, as the metrics need them.

use super::truth::JointPositions;
use crate::geometry::{PerVertex, TriMesh, VertexId};

/// The result of one step.
///
/// **Shapes** `labels` has one entry per vertex of `scan`, `covered` one per vertex of `body`.
#[derive(Clone, Debug)]
pub struct ResultStep {
    /// `body`, or the name of the garment that this step added.
    pub name: String,
    /// The body, posed, with the step's offsets.
    pub body: TriMesh,
    /// For the naked step: the model's surface of β and θ alone, posed, before registration.
    pub fitted: Option<TriMesh>,
    /// The garments so far, posed, in the order in which they were put on.
    pub garments: Vec<(String, TriMesh)>,
    /// Joint centres, posed.
    pub joints: JointPositions,
    /// The cleaned scan.
    pub scan: TriMesh,
    /// The new garment's label of each vertex of `scan`; `None` for the naked step.
    pub labels: Option<PerVertex<bool>>,
    /// Which vertices of `body` the new garment's template covers; `None` for the naked step.
    pub covered: Option<PerVertex<bool>>,
    /// Distance outside the noisy scan up to which skin counts as inside: metres, as the fit states it.
    pub margin: f64,
    /// The boundary loops of the new garment that are hems, as the cut tells hems from holes; `None` for the naked step.
    pub hem_loops: Option<Vec<Vec<VertexId>>>,
    /// Index of the true layer that is the new garment; `None` where the truth's layers are those of the steps, in their order.
    pub true_layer: Option<usize>,
    /// Indices of true layers that are hair. They hide no skin from the metrics of the body under cloth.
    pub true_hair: Vec<usize>,
    /// How many hems the template expects.
    pub hem_loops_expected: Option<usize>,
}

/// The result of a session in the bind pose.
#[derive(Clone, Debug, Default)]
pub struct ResultBind {
    /// Name and surface per layer, innermost first; the body is the first.
    pub layers: Vec<(String, TriMesh)>,
    /// All layers, in the same order, skinned into poses in which cloth must not tear.
    pub in_poses: Vec<Vec<TriMesh>>,
}
