//! The registered surface in the bind pose.

use crate::body::{BodyModel, Pose, Skeleton, unskin};
use crate::fit::naked::FittedBody;
use crate::geometry::{PerVertex, Point};

/// Finds bind-pose points and a skeleton inside them that the fit's rotations transform to `points_in_world`.
///
/// The skeleton follows from the points (Eq. 1) and the points from the skeleton (Eq. 3 inverted): a fixed-point iteration. Each
/// round reduces the error; it halves it for limbs far from the bind pose.
pub(crate) fn into_bind_pose(
    model: &BodyModel,
    fitted: &FittedBody,
    points_in_world: &PerVertex<Point>,
) -> (PerVertex<Point>, Skeleton, Pose) {
    const ROUNDS: usize = 12;
    const DAMPING: f64 = 0.7;
    let mut skeleton = fitted.skeleton.clone();
    let mut pose = fitted.pose.clone();
    for _ in 0..ROUNDS {
        let points = unskin(points_in_world, &model.weights, &skeleton, &pose);
        let found = model.skeleton_inside(&points);
        // The root keeps its place in the bind pose; its place in the world goes into the translation.
        let root_in_world = skeleton.world_from_bind(&pose)[0] * found.joints_in_bind[0];
        let shift = skeleton.joints_in_bind[0] - found.joints_in_bind[0];
        for (joint, target) in skeleton.joints_in_bind.iter_mut().zip(&found.joints_in_bind) {
            *joint += (target + shift - *joint) * DAMPING;
        }
        pose.translation = root_in_world - skeleton.joints_in_bind[0];
    }
    let points = unskin(points_in_world, &model.weights, &skeleton, &pose);
    (points, skeleton, pose)
}
