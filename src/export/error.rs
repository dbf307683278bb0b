//! Errors of exports.

use crate::formats::FormatError;

/// Why a figure could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The bytes could not be produced or written.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// Writing the stream failed.
    #[error("the joints could not be written: {source}")]
    Io {
        /// The system's error.
        source: std::io::Error,
    },
    /// The figure has no layer.
    #[error("the figure has no surface: there is nothing to write")]
    NoLayers,
    /// A number of quads that means edges of a useless length.
    #[error("{count} quads are too {} for the surface of these layers: {least} to {most} are possible", if count < least { "few" } else { "many" })]
    QuadCount {
        /// The requested number.
        count: usize,
        /// The least that is possible.
        least: usize,
        /// The greatest that is possible.
        most: usize,
    },
    /// A number of faces that the figure cannot be reduced to.
    #[error("the figure has {present} faces and cannot be reduced to {count}: at least {least} are possible")]
    FaceCount {
        /// The requested number.
        count: usize,
        /// The least that is possible.
        least: usize,
        /// Those that it has.
        present: usize,
    },
    /// A number is NaN or infinite.
    #[error("{what}: entry {index} is not a finite number")]
    NotFinite {
        /// Which array.
        what: String,
        /// The first such entry.
        index: usize,
    },
    /// A layer has no vertices or no faces.
    #[error("layer '{layer}' has {vertices} vertices and {faces} faces: there is nothing to write")]
    EmptyLayer {
        /// The layer's name.
        layer: String,
        /// Vertices of its mesh.
        vertices: usize,
        /// Faces of its mesh.
        faces: usize,
    },
    /// An attribute of a layer has another length than its mesh.
    #[error("layer '{layer}' has {found} {attribute}, but {expected} vertices")]
    Length {
        /// The layer's name.
        layer: String,
        /// The attribute of the wrong length.
        attribute: String,
        /// Its length.
        found: usize,
        /// Vertices of its mesh.
        expected: usize,
    },
    /// A vertex has a skin weight for a joint that the skeleton does not have.
    #[error("layer '{layer}', vertex {vertex} has a weight for joint {joint}, but the skeleton has {joints} joints")]
    NoSuchJoint {
        /// The layer's name.
        layer: String,
        /// The first such vertex.
        vertex: usize,
        /// The missing joint.
        joint: usize,
        /// Joints of the skeleton.
        joints: usize,
    },
    /// The skeleton has no joint, or its lists disagree.
    #[error("the skeleton has {joints} joints with {names} names and {parents} parents")]
    Skeleton {
        /// Number of joint centres.
        joints: usize,
        /// Number of names.
        names: usize,
        /// Number of parents.
        parents: usize,
    },
    /// A joint precedes its parent in the skeleton's lists, or the parent is not in them.
    #[error("joint {parent} of the skeleton does not come before all of its children")]
    JointOrder {
        /// The parent.
        parent: usize,
    },
    /// The skeleton lacks bones that the format requires.
    #[error("the skeleton has no bone {missing}, which a VRM avatar has to have")]
    NoBones {
        /// Their names in VRM.
        missing: String,
    },
    /// A pose belongs to another skeleton.
    #[error("the pose has {found} rotations, but the skeleton has {expected} joints")]
    PoseLength {
        /// Rotations of the pose.
        found: usize,
        /// Joints of the skeleton.
        expected: usize,
    },
}

impl ExportError {
    /// What the user can do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Format(error) => error.hint(),
            Self::EmptyLayer { layer, .. } => {
                Some(format!("check the labels of '{layer}': its garment was not found in the scan"))
            }
            Self::NoBones { .. } => Some("export a .glb, which takes any skeleton".into()),
            Self::QuadCount { .. } => {
                Some("leave the count out for quads about as fine as the layers' triangles".into())
            }
            Self::FaceCount { count, least, .. } if count < least => Some(format!("give --faces {least} or more")),
            Self::FaceCount { .. } => Some("give fewer, or leave --faces out for all".into()),
            Self::Io { .. }
            | Self::NoLayers
            | Self::NotFinite { .. }
            | Self::Length { .. }
            | Self::NoSuchJoint { .. }
            | Self::Skeleton { .. }
            | Self::JointOrder { .. }
            | Self::PoseLength { .. } => None,
        }
    }
}
