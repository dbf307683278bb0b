//! The bone that a vertex belongs to, and its position along that bone.

use super::{JointId, Skeleton, SkinWeights, dominant_body_joint};
use crate::geometry::{PerVertex, Point};

/// A position along a bone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BonePosition {
    /// The joint at the start of the bone.
    pub joint: JointId,
    /// 0 at the joint, 1 at the end of the bone; below 0 or above 1 where the surface extends further. For a bone without
    /// an end (head, hand, toes): the distance from the joint along the parent bone's direction, relative to the farthest
    /// vertex of the part.
    pub along: f64,
}

/// For each vertex the joint with the largest weight (fingers count as part of the hand), and the position along that joint's
/// bone, in the bind pose.
///
/// **Shapes** one entry per vertex, in and out.
pub fn bone_positions(
    points_in_bind: &PerVertex<Point>,
    weights: &SkinWeights,
    skeleton: &Skeleton,
) -> PerVertex<BonePosition> {
    let body_joints = skeleton.body_joints();
    let end_of = |joint: JointId| match body_joints[joint.index()] == joint {
        true => bone_end_point(points_in_bind, weights, skeleton, &body_joints, joint),
        false => Point::origin(),
    };
    let ends: Vec<Point> = skeleton.ids().map(end_of).collect();
    points_in_bind
        .iter()
        .zip(weights.rows().iter())
        .map(|(p, row)| {
            let joint = dominant_body_joint(row, &body_joints);
            let start = skeleton.joints_in_bind[joint.index()];
            let axis = ends[joint.index()] - start;
            let along = (p - start).dot(&axis) / axis.norm_squared().max(1e-12);
            BonePosition { joint, along }
        })
        .collect()
}

fn bone_end_point(
    points: &PerVertex<Point>,
    weights: &SkinWeights,
    skeleton: &Skeleton,
    body_joints: &[JointId],
    joint: JointId,
) -> Point {
    let start = skeleton.joints_in_bind[joint.index()];
    if let Some(end) = skeleton.bone_end(joint) {
        return skeleton.joints_in_bind[end.index()];
    }
    let Some(parent) = skeleton.parents[joint.index()] else { return start };
    let direction = (start - skeleton.joints_in_bind[parent.index()])
        .try_normalize(1e-9)
        .unwrap_or_else(|| -crate::geometry::Vec3::y());
    let reach = points
        .iter()
        .zip(weights.rows().iter())
        .filter(|(_, row)| dominant_body_joint(row, body_joints) == joint)
        .map(|(p, _)| (p - start).dot(&direction))
        .fold(0.0, f64::max);
    start + direction * reach.max(1e-3)
}
