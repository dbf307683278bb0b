//! Errors of driving.

/// Why landmarks cannot drive a figure.
#[derive(Debug, thiserror::Error)]
pub enum DriveError {
    /// Too few landmarks for a pose.
    #[error("only {seen} landmarks are seen while the wearer stands still: 8 or more determine a pose")]
    TooFewLandmarks {
        /// How many.
        seen: usize,
    },
    /// Nobody stood still in a T- or A-pose.
    #[error("nobody stands still in a T- or A-pose for 2 seconds: {why}")]
    NoCalibrationPose {
        /// What was seen instead, as a clause.
        why: String,
    },
    /// No pose library comes of the given clips.
    #[error("no pose library can be built: {why}")]
    Untrainable {
        /// Why, as a clause.
        why: String,
    },
    /// The pose library cannot be used.
    #[error(transparent)]
    Library(#[from] super::recognition::LibraryError),
    /// Poses cannot be recognised.
    #[error(transparent)]
    Recognition(#[from] super::recognition::RecognitionError),
    /// The figure's mesh cannot be factorised.
    #[error("the Laplacian of the figure's body cannot be factorised: {0}")]
    Singular(#[from] crate::numerics::NumericsError),
}

impl DriveError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::TooFewLandmarks { .. } => "check the names of the landmarks, and that the tracker sees the whole person".into(),
            Self::NoCalibrationPose { .. } => {
                "begin the stream with 2 seconds in a T- or A-pose: upright, legs straight, both arms away from the body".into()
            }
            Self::Untrainable { .. } => "give more and more varied clips".into(),
            Self::Library(_) => "build the library again with `overcoat drive train`".into(),
            Self::Recognition(error) => return error.hint(),
            Self::Singular(error) => return error.hint(),
        })
    }
}
