//! How far skinning stretches cloth.

use crate::geometry::{Adjacency, TriMesh};
use serde::{Deserialize, Serialize};

/// Shorter edges, in metres, are slivers along a cut: rounding changes their length by several percent.
const LEAST_LENGTH: f64 = 2e-3;

/// The ratio by which edges become longer from the bind pose to the poses in which cloth must not tear.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseStretch {
    /// Of one edge of a thousand and more; the worst pose counts.
    pub pose_stretch_p999: f64,
    /// Of the edge that is stretched most.
    pub pose_stretch_max: f64,
}

/// The stretch of one surface. Edges under 2 mm do not count.
///
/// **Shapes** `in_poses`: the same mesh with other points, once per pose.
///
/// `None` without poses or without edges.
pub fn pose_stretch<'a>(in_bind: &TriMesh, in_poses: impl Iterator<Item = &'a TriMesh>) -> Option<PoseStretch> {
    let length = |mesh: &TriMesh, [a, b]: [_; 2]| (mesh.points()[a] - mesh.points()[b]).norm();
    let adjacency = Adjacency::prepare(in_bind);
    let edges = adjacency.edges().iter().map(|(ends, _)| (*ends, length(in_bind, *ends)));
    let edges: Vec<_> = edges.filter(|(_, length)| *length > LEAST_LENGTH).collect();
    let last = edges.len().checked_sub(1)?;
    let of_pose = |posed: &TriMesh| {
        let mut ratios: Vec<f64> = edges.iter().map(|&(ends, rest)| length(posed, ends) / rest).collect();
        ratios.sort_unstable_by(f64::total_cmp);
        (ratios[(0.999 * last as f64).round() as usize], ratios[last])
    };
    let worst = in_poses.map(of_pose).reduce(|a, b| (a.0.max(b.0), a.1.max(b.1)))?;
    Some(PoseStretch { pose_stretch_p999: worst.0, pose_stretch_max: worst.1 })
}
