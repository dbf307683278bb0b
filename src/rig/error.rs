//! Why a garment cannot be rigged.

use crate::numerics::NumericsError;

/// Why a garment cannot be rigged.
#[derive(Debug, thiserror::Error)]
pub enum RigError {
    /// A parameter has a value that it may not have.
    #[error(transparent)]
    Parameter(#[from] crate::parameters::NotAllowed),
    /// No faces.
    #[error("the garment has no faces")]
    EmptyGarment,
    /// The garment is not around this body.
    #[error("the garment is not on the body: the closest vertex is {nearest:.2} m away")]
    FarFromBody {
        /// Least distance of a vertex, in metres.
        nearest: f64,
    },
    /// An array has the wrong length.
    #[error("{what}: {given} values for {expected} vertices")]
    WrongLength {
        /// Which array.
        what: &'static str,
        /// Its length.
        given: usize,
        /// The length it should have.
        expected: usize,
    },
    /// Skin weights name a joint that the skeleton does not have.
    #[error("a skin weight is for joint {joint}, but the skeleton has {joints} joints")]
    NoSuchJoint {
        /// The joint, from 0.
        joint: usize,
        /// Joints of the skeleton.
        joints: usize,
    },
    /// No faces of the body.
    #[error("the body has no faces")]
    EmptyBody,
    /// The linear system for the weights could not be solved.
    #[error("the linear system for the garment's weights has no solution")]
    Unsolved(#[from] NumericsError),
}

impl RigError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::EmptyGarment => Some("the labels left nothing: look at the segmentation of this step".into()),
            Self::FarFromBody { .. } => Some(
                "garment and body are not in the same frame or pose: check that they come from the same step".into(),
            ),
            Self::WrongLength { .. } | Self::NoSuchJoint { .. } | Self::EmptyBody | Self::Parameter(_) => None,
            Self::Unsolved(error) => error.hint(),
        }
    }
}
