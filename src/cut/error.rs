//! Why nothing could be cut.

/// Why nothing could be cut.
#[derive(Debug, thiserror::Error)]
pub enum CutError {
    /// A parameter has a value that it may not have.
    #[error(transparent)]
    Parameter(#[from] crate::parameters::NotAllowed),
    /// The labels belong to another scan.
    #[error("there are {labels} labels, but the scan has {vertices} vertices")]
    LabelCount {
        /// Labels given.
        labels: usize,
        /// Vertices of the scan.
        vertices: usize,
    },
    /// An argument belongs to another scan.
    #[error("{what}: {given} given, but the scan needs {expected}")]
    WrongLength {
        /// Which argument.
        what: &'static str,
        /// Its length.
        given: usize,
        /// The length it should have.
        expected: usize,
    },
    /// No hems, or the least number of hems exceeds the greatest.
    #[error("a garment cannot have {least} to {most} hems")]
    BadLoopRange {
        /// Least number.
        least: usize,
        /// Greatest number.
        most: usize,
    },
    /// No vertex is labelled.
    #[error(
        "no part of the scan belongs to the garment ({labelled} of {vertices} vertices are labelled, no face is left)"
    )]
    NothingLabelled {
        /// Vertices labelled as the garment.
        labelled: usize,
        /// Vertices of the scan.
        vertices: usize,
    },
    /// The cut or a filled hole has a coordinate that is not a number.
    #[error("the cut made an invalid mesh: {0}")]
    Mesh(#[from] crate::geometry::MeshError),
    /// The linear system of the smoothing has no solution.
    #[error("the boundary could not be smoothed: {0}")]
    Numerics(#[from] crate::numerics::NumericsError),
}

impl CutError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::Parameter(_) | Self::WrongLength { .. } | Self::BadLoopRange { .. } => return None,
            Self::LabelCount { .. } => "labels belong to one cleaned scan: make new ones for this scan".into(),
            Self::NothingLabelled { .. } => {
                "check the template and the scan, or say where the garment is with --until, --sleeve or a brush mask"
                    .into()
            }
            Self::Mesh(_) | Self::Numerics(_) => {
                "the scan has faces without area: scan it again with more decimation".into()
            }
        })
    }
}
