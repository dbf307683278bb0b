//! Measures of agreement that several fits share.

use crate::body::{JointId, Skeleton, SkinWeights, dominant_body_joint};
use crate::geometry::VertexId;

/// Mean and 95th percentile of distances; 0 if there are none.
pub(crate) fn mean_and_p95(mut distances: Vec<f64>) -> (f64, f64) {
    distances.sort_by(f64::total_cmp);
    let count = distances.len().max(1);
    let p95 = distances.get(count * 95 / 100).copied().unwrap_or(0.0);
    (distances.iter().sum::<f64>() / count as f64, p95)
}

/// The joint that moves the greatest area of these vertices. Each vertex counts for the joint with its greatest skin weight.
pub(crate) fn dominant_joint(
    areas: impl Iterator<Item = (VertexId, f64)>,
    weights: &SkinWeights,
    skeleton: &Skeleton,
) -> Option<JointId> {
    let (mut of_joint, body_joints) = (vec![0.0; skeleton.len()], skeleton.body_joints());
    for (v, area) in areas {
        of_joint[dominant_body_joint(&weights.rows()[v], &body_joints).index()] += area;
    }
    let most = of_joint.iter().enumerate().filter(|of| *of.1 > 0.0).max_by(|a, b| a.1.total_cmp(b.1))?;
    Some(JointId(most.0 as u16))
}
