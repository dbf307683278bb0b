//! Why a garment cannot be stacked.

use crate::numerics::NumericsError;

/// Why a garment cannot be stacked.
#[derive(Debug, thiserror::Error)]
pub enum StackError {
    /// A parameter has a value that it may not have.
    #[error(transparent)]
    Parameter(#[from] crate::parameters::NotAllowed),
    /// The moved surfaces are not a mesh.
    #[error("stacking made an invalid mesh: {0}")]
    Mesh(#[from] crate::geometry::MeshError),
    /// A layer is made of an unknown fabric.
    #[error(transparent)]
    Fabric(#[from] crate::segment::SegmentError),
    /// No faces.
    #[error("the garment has no faces")]
    EmptyGarment,
    /// Skin weights name a joint that the skeleton does not have.
    #[error("a skin weight is for joint {joint}, but the skeleton has {joints} joints")]
    NoSuchJoint {
        /// The joint, from 0.
        joint: usize,
        /// Joints of the skeleton.
        joints: usize,
    },
    /// The number of skin weights differs from that of vertices.
    #[error("'{layer}' has {weights} skin weights for {vertices} vertices")]
    WrongLength {
        /// The layer, or `the garment`.
        layer: String,
        /// Rows of weights.
        weights: usize,
        /// Vertices.
        vertices: usize,
    },
    /// The number of posed surfaces differs from that of the figure's layers.
    #[error("there are {surfaces} posed surfaces for the {layers} layers of the figure")]
    SurfaceCount {
        /// Surfaces given.
        surfaces: usize,
        /// Layers of the figure.
        layers: usize,
    },
    /// The displacement's linear system could not be solved.
    #[error("the linear system for the garment's displacement has no solution")]
    Unsolved(#[from] NumericsError),
}

impl StackError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::EmptyGarment => Some("the labels left nothing: look at the segmentation of this step".into()),
            Self::WrongLength { .. } | Self::SurfaceCount { .. } | Self::NoSuchJoint { .. } | Self::Parameter(_) => {
                None
            }
            Self::Fabric(error) => error.hint(),
            Self::Mesh(_) => None,
            Self::Unsolved(error) => error.hint(),
        }
    }
}
