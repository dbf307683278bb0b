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
    /// The layers cross before anything has moved.
    #[error("{pairs} pairs of faces of the figure cross in the bind pose, and cloth that starts crossed stays crossed")]
    Crossing {
        /// How many.
        pairs: usize,
    },
    /// A layer is made of an unknown fabric.
    #[error("{what}")]
    UnknownFabric {
        /// Which, and those that are known.
        what: String,
    },
    /// Mass–spring cloth whose triangles are so small that its steps leave its springs no stiffness.
    #[error("{layer}: its triangles are too small for mass–spring steps, half of its springs would keep less than {:.0} % of their fabric's stiffness", share * 100.0)]
    TooFine {
        /// Which layer.
        layer: String,
        /// What the median spring would keep.
        share: f64,
    },
    /// A layer whose shape cannot be computed with.
    #[error("a layer of cloth is broken: {0}")]
    Matrix(#[from] crate::numerics::NumericsError),
    /// A parameter that cannot be.
    #[error(transparent)]
    Parameter(#[from] crate::parameters::NotAllowed),
}

impl ClothError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::CountMismatch { .. } => None,
            Self::BadDuration { .. } => Some("give a finite number of seconds, 0 or more".into()),
            Self::Crossing { .. } => {
                Some("`overcoat status -v` names the layers; --mode lbs moves them without cloth".into())
            }
            Self::TooFine { .. } => Some(
                "rk4 is for garments of even triangles of 15 mm and more; the solver xpbd, the default, moves any"
                    .into(),
            ),
            Self::UnknownFabric { .. } | Self::Parameter(_) | Self::Matrix(_) => None,
            Self::BadFabric { .. } => Some("density, stretch and bending must be greater than 0".into()),
        }
    }
}
