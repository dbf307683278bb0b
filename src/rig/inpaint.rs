//! Weight inpainting: where no match is confident, the weights are interpolated smoothly from those that are.

use super::error::RigError;
use super::params::RigParams;
use crate::body::JointId;
use crate::geometry::{PerVertex, TriMesh, cotangent_laplacian};
use crate::numerics::SparseCholesky;

/// Confidence of a vertex without any: it acts only over tens of metres, so it decides only in components of the garment
/// in which no match is confident. (At 1e-6, which acts over 0.3 m, a skirt split between the legs.)
const LEAST_CONFIDENCE: f64 = 1e-10;

/// Solves `(diag(c · M) + ℓ₁² L + ℓ₂⁴ L M⁻¹ L) w = diag(c · M) w₀` for each joint, with the confidences `c`, then clamps
/// to w ≥ 0.
///
/// **Shapes** `rows` and `confidence`: one entry per vertex, in and out.
///
/// **Source** Abdrashitov 2023, Eq. 3. There confident weights are hard constraints; here they are weighted by their
/// confidence, which also smooths the noise of the scan. `ℓ₂` is `smoothing_length`; `ℓ₁ = ℓ₂² / fairing_width`, so that wide gaps are bridged by the
/// Laplacian, which does not overshoot.
pub(super) fn inpaint(
    garment: &TriMesh,
    rows: &PerVertex<Vec<(JointId, f64)>>,
    confidence: &PerVertex<f64>,
    joint_count: usize,
    params: &RigParams,
) -> Result<PerVertex<Vec<(JointId, f64)>>, RigError> {
    let count = garment.vertex_count();
    let laplacian = cotangent_laplacian(garment);
    let mass = laplacian.safe_mass();
    let weights: Vec<f64> = confidence.iter().map(|c| c.max(LEAST_CONFIDENCE)).collect();
    let bending_length = params.smoothing_length;
    let membrane_length = bending_length * bending_length / params.fairing_width.max(bending_length);
    let matrix = laplacian.screened(&weights, membrane_length.powi(2), bending_length.powi(4));
    let factor = SparseCholesky::prepare(count, &matrix)?;

    let mut columns_of_joint: Vec<Option<usize>> = vec![None; joint_count];
    let mut joints: Vec<JointId> = Vec::new();
    for joint in (0..joint_count as u16).map(JointId) {
        if rows.iter().any(|row| row.iter().any(|&(j, w)| j == joint && w > 0.0)) {
            columns_of_joint[joint.index()] = Some(joints.len());
            joints.push(joint);
        }
    }
    let mut columns = vec![0.0; count * joints.len()];
    for (v, row) in rows.iter().enumerate() {
        for &(joint, w) in row {
            if let Some(column) = columns_of_joint[joint.index()] {
                columns[column * count + v] += w * weights[v] * mass[v];
            }
        }
    }
    factor.solve_in_place(&mut columns);
    Ok((0..count)
        .map(|v| joints.iter().enumerate().map(|(c, &joint)| (joint, columns[c * count + v].max(0.0))).collect())
        .collect())
}
