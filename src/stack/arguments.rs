//! Checks of the arguments of this module's entry functions.

use super::error::StackError;
use crate::body::{Skeleton, SkinWeights};
use crate::geometry::TriMesh;

/// One row of weights per vertex, for joints of the skeleton.
pub(super) fn check_weights(
    layer: &str,
    mesh: &TriMesh,
    weights: &SkinWeights,
    skeleton: &Skeleton,
) -> Result<(), StackError> {
    let (given, vertices) = (weights.len(), mesh.vertex_count());
    if given != vertices {
        return Err(StackError::WrongLength { layer: layer.into(), weights: given, vertices });
    }
    let (joint_count, joints) = (weights.least_joint_count(), skeleton.len());
    if joint_count > joints {
        return Err(StackError::NoSuchJoint { joint: joint_count - 1, joints });
    }
    Ok(())
}
