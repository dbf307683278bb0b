//! Why poses cannot be recognised.

/// Why no angles can be selected and no recogniser be trained.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RecognitionError {
    /// There is nothing to learn from.
    #[error("no pose has all {angles} angles of the descriptor")]
    NoSamples {
        /// Angles of the descriptor.
        angles: usize,
    },
    /// There are fewer labels than samples, or more.
    #[error("{labels} class labels for {samples} poses")]
    LabelCount {
        /// Poses.
        samples: usize,
        /// Their labels.
        labels: usize,
    },
    /// All poses are of the same class.
    #[error("all {samples} poses belong to one class")]
    OneClass {
        /// Poses.
        samples: usize,
    },
    /// An angle of a training pose is not defined.
    #[error("pose {sample}: angle {angle} of the descriptor is not defined")]
    UndefinedAngle {
        /// The first such pose.
        sample: usize,
        /// The first such angle, counted in the descriptor.
        angle: usize,
    },
    /// The decision tree or the support vector machine failed.
    #[error("training failed: {reason}")]
    Training {
        /// What the library says.
        reason: String,
    },
}

impl RecognitionError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::NoSamples { .. } | Self::UndefinedAngle { .. } => {
                Some("train on complete poses: a landmark is lost, or two landmarks are at the same place".into())
            }
            Self::OneClass { .. } => Some("give more varied clips, or ask for more classes".into()),
            Self::LabelCount { .. } | Self::Training { .. } => None,
        }
    }
}
