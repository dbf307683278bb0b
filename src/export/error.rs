//! What can keep a figure from becoming a file.

use crate::formats::FormatError;

/// Why a figure could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The bytes could not be made or written.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The stream failed.
    #[error("the joints could not be written: {source}")]
    Io {
        /// What the system said.
        source: std::io::Error,
    },
    /// A layer has nothing to draw.
    #[error("layer '{layer}' has {vertices} vertices and {faces} faces: there is nothing to write")]
    EmptyLayer {
        /// Its name.
        layer: String,
        /// Of its mesh.
        vertices: usize,
        /// Of its mesh.
        faces: usize,
    },
    /// An attribute of a layer has another length than its mesh.
    #[error("layer '{layer}' has {found} {attribute}, but {expected} vertices")]
    Length {
        /// Its name.
        layer: String,
        /// What is too long or short.
        attribute: String,
        /// How many there are.
        found: usize,
        /// Vertices of its mesh.
        expected: usize,
    },
    /// A vertex follows a joint that the skeleton does not have.
    #[error("layer '{layer}', vertex {vertex} follows joint {joint}, but the skeleton has {joints} joints")]
    NoSuchJoint {
        /// Its name.
        layer: String,
        /// The first such vertex.
        vertex: usize,
        /// The joint that it names.
        joint: usize,
        /// How many there are.
        joints: usize,
    },
    /// The skeleton has no joint, or its lists disagree.
    #[error("the skeleton has {joints} joints with {names} names and {parents} parents")]
    Skeleton {
        /// Joint centres.
        joints: usize,
        /// Names.
        names: usize,
        /// Parents.
        parents: usize,
    },
    /// A pose is that of another skeleton.
    #[error("the pose has {found} rotations, but the skeleton has {expected} joints")]
    PoseLength {
        /// Rotations.
        found: usize,
        /// Joints.
        expected: usize,
    },
}

impl ExportError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Format(error) => error.hint(),
            Self::EmptyLayer { layer, .. } => {
                Some(format!("look at the labels of '{layer}': its garment was not found in the scan"))
            }
            Self::Io { .. }
            | Self::Length { .. }
            | Self::NoSuchJoint { .. }
            | Self::Skeleton { .. }
            | Self::PoseLength { .. } => None,
        }
    }
}
