//! What keeps a session from being measured.

/// What keeps a session from being measured.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    /// The session has more steps than the truth.
    #[error("the session has {steps} steps, but the truth only {truth_steps}")]
    MoreStepsThanTruth {
        /// The session's.
        steps: usize,
        /// The truth's.
        truth_steps: usize,
    },
    /// The truth has no layer for the garment of a step.
    #[error("step {step} ('{name}') brought garment {garment}, but its truth has {layers} layers")]
    LayerMissing {
        /// The step.
        step: usize,
        /// Its name.
        name: String,
        /// Which garment, from 1.
        garment: usize,
        /// How many the truth has.
        layers: usize,
    },
    /// An attribute of a different mesh.
    #[error("step {step} ('{name}') has {found} values of '{what}' for {expected} vertices")]
    CountMismatch {
        /// The step.
        step: usize,
        /// Its name.
        name: String,
        /// `labels` or `covered`.
        what: &'static str,
        /// Values.
        found: usize,
        /// Vertices.
        expected: usize,
    },
    /// A garment step without labels.
    #[error("step {step} ('{name}') has a garment, but no labels")]
    LabelsMissing {
        /// The step.
        step: usize,
        /// Its name.
        name: String,
    },
    /// An array without one value per vertex of its mesh.
    #[error("{found} {what} were given for {expected} vertices")]
    WrongLength {
        /// Which array.
        what: &'static str,
        /// Values.
        found: usize,
        /// Vertices.
        expected: usize,
    },
    /// An index of a layer that does not exist.
    #[error("there is no layer {garment} among {layers}")]
    NoSuchLayer {
        /// The index, from 0.
        garment: usize,
        /// The number of layers.
        layers: usize,
    },
    /// `joints.json` cannot be read.
    #[error("the truth's joints.json cannot be read: {reason}")]
    BadJoints {
        /// Line, column and cause.
        reason: String,
    },
}

impl MeasureError {
    pub(super) fn check_length(what: &'static str, found: usize, expected: usize) -> Result<(), Self> {
        if found == expected { Ok(()) } else { Err(Self::WrongLength { what, found, expected }) }
    }

    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::MoreStepsThanTruth { .. } | Self::LayerMissing { .. } => {
                "the truth folder must be that of this very session: K_body.ply and K_layer1.ply … K_layerK.ply for each step K".into()
            }
            Self::CountMismatch { .. }
            | Self::LabelsMissing { .. }
            | Self::WrongLength { .. }
            | Self::NoSuchLayer { .. } => "this is a fault of the program, not of your data; please report it".into(),
            Self::BadJoints { .. } => {
                r#"expected {"names": […], "steps": [{"joints": {"hips": [x, y, z], …}}, …]}, metres"#.into()
            }
        })
    }
}
