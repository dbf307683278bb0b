//! Errors of baking.

/// Why a surface could not be given a texture.
#[derive(Debug, thiserror::Error)]
pub enum BakeError {
    /// The surface could not be cut into charts.
    #[error("the surface of {faces} faces could not be cut into charts: {reason}")]
    Charts {
        /// Faces of the surface.
        faces: usize,
        /// Why.
        reason: String,
    },
}

impl BakeError {
    /// What the user can do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Charts { .. } => {
                Some("export with `--texture none`: the colours are then those of the vertices".into())
            }
        }
    }
}
