//! What cannot be draped.

/// What cannot be draped.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ClothError {
    /// Arrays that belong together differ in length.
    #[error("{what}: {found} given, {expected} expected")]
    CountMismatch {
        /// Which array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length of the array that it belongs to.
        expected: usize,
    },
    /// The duration is negative, infinite or NaN.
    #[error("cloth cannot settle for {secs} seconds")]
    BadDuration {
        /// The duration given.
        secs: f64,
    },
    /// A density or stiffness that is not positive, or a negative thickness.
    #[error("layer {layer} has a fabric that does not exist: {fabric:?}")]
    BadFabric {
        /// Index of the layer, 0 the innermost.
        layer: usize,
        /// Its fabric.
        fabric: super::fabric::Fabric,
    },
}

impl ClothError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::CountMismatch { .. } => None,
            Self::BadDuration { .. } => Some("give a finite number of seconds, 0 or more".into()),
            Self::BadFabric { .. } => Some("density, stretch and bending must be greater than 0".into()),
        }
    }
}
