//! Weight inpainting: where no match is confident, the weights are interpolated smoothly from those that are.

use super::error::RigError;
use super::params::RigParams;
use crate::body::JointId;
use crate::geometry::{PerVertex, TriMesh, VertexId, cotangent_laplacian};
use crate::numerics::SparseCholesky;

/// Confidence of a vertex without any: it acts only over tens of metres, so it decides only in components of the garment
/// in which no match is confident. (At 1e-6, which acts over 0.3 m, a skirt split between the legs.)
const LEAST_CONFIDENCE: f64 = 1e-10;

/// The solve for the weights of one garment: prepared once, repeated with edges of other stiffness.
pub(super) struct Inpainting {
    /// Joints with weight anywhere, in the order of the columns.
    joints: Vec<JointId>,
    /// The right-hand sides, one column per joint.
    targets: Vec<f64>,
    triplets: Vec<(usize, usize, f64)>,
    /// Where in `triplets` the edges begin: two entries on the diagonal and one below it per edge.
    first_of_edges: usize,
    factor: SparseCholesky,
}

impl Inpainting {
    /// Prepares `(diag(c · M) + ℓ₁² L + ℓ₂⁴ L M⁻¹ L + S) w = diag(c · M) w₀` with the confidences `c` and no stiffness `S`.
    ///
    /// **Shapes** `rows` and `confidence`: one entry per vertex; `edges`: those that may become stiffer.
    ///
    /// **Source** Abdrashitov 2023, Eq. 3. There confident weights are hard constraints; here they are weighted by their
    /// confidence, which also smooths the noise of the scan. `ℓ₂` is `smoothing_length`; `ℓ₁ = ℓ₂² / fairing_width`, so that wide gaps are bridged by the
    /// Laplacian, which does not overshoot. `S` is ours.
    pub fn prepare(
        garment: &TriMesh,
        rows: &PerVertex<Vec<(JointId, f64)>>,
        confidence: &PerVertex<f64>,
        joint_count: usize,
        edges: &[[VertexId; 2]],
        params: &RigParams,
    ) -> Result<Self, RigError> {
        let count = garment.vertex_count();
        let laplacian = cotangent_laplacian(garment);
        let mass = laplacian.safe_mass();
        let weights: Vec<f64> = confidence.iter().map(|c| c.max(LEAST_CONFIDENCE)).collect();
        let bending_length = params.smoothing_length;
        let membrane_length = bending_length * bending_length / params.fairing_width.max(bending_length);
        let mut triplets = laplacian.screened(&weights, membrane_length.powi(2), bending_length.powi(4));
        let first_of_edges = triplets.len();
        triplets.extend(edges.iter().flat_map(|&ends| places_of_edge(ends).map(|(row, column)| (row, column, 0.0))));
        let factor = SparseCholesky::prepare(count, &triplets)?;

        let mut columns_of_joint: Vec<Option<usize>> = vec![None; joint_count];
        let mut joints: Vec<JointId> = Vec::new();
        for joint in (0..joint_count as u16).map(JointId) {
            if rows.iter().any(|row| row.iter().any(|&(j, w)| j == joint && w > 0.0)) {
                columns_of_joint[joint.index()] = Some(joints.len());
                joints.push(joint);
            }
        }
        let mut targets = vec![0.0; count * joints.len()];
        for (v, row) in rows.iter().enumerate() {
            for &(joint, w) in row {
                if let Some(column) = columns_of_joint[joint.index()] {
                    targets[column * count + v] += w * weights[v] * mass[v];
                }
            }
        }
        Ok(Self { joints, targets, triplets, first_of_edges, factor })
    }

    /// The weights, clamped to w ≥ 0.
    ///
    /// **Shapes** one row per vertex.
    pub fn rows(&self) -> PerVertex<Vec<(JointId, f64)>> {
        let count = self.factor.size();
        let mut columns = self.targets.clone();
        self.factor.solve_in_place(&mut columns);
        let row = |v: usize| {
            self.joints.iter().enumerate().map(|(c, &joint)| (joint, columns[c * count + v].max(0.0))).collect()
        };
        (0..count).map(row).collect()
    }

    /// Gives the edges another stiffness: the solve minimises the sum of `stiffness · (difference of the weights)²` over the
    /// edges as well.
    ///
    /// **Shapes** one value ≥ 0, in m², per edge of [`prepare`](Self::prepare).
    pub fn stiffen(&mut self, stiffness: &[f64]) -> Result<(), RigError> {
        for (edge, &s) in stiffness.iter().enumerate() {
            let first = self.first_of_edges + 3 * edge;
            for (triplet, value) in self.triplets[first..first + 3].iter_mut().zip([s, s, -s]) {
                triplet.2 = value;
            }
        }
        let values: Vec<f64> = self.triplets.iter().map(|triplet| triplet.2).collect();
        Ok(self.factor.refactor(&values)?)
    }
}

/// The entries of the matrix that an edge adds to: both on the diagonal, and the one below it.
fn places_of_edge([a, b]: [VertexId; 2]) -> [(usize, usize); 3] {
    let (a, b) = (a.index(), b.index());
    [(a, a), (b, b), (a.max(b), a.min(b))]
}
