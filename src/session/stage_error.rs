//! What the rooms say, in one type.

use crate::body::BodyError;
use crate::fit::FitError;
use crate::formats::FormatError;

/// What a room says when it gives no result.
#[derive(Debug, thiserror::Error)]
pub enum StageError {
    /// Bytes that are not the file they should be.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// No body model.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// No fit.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// A stage that this version lacks.
    #[error("the stage is not available in this version")]
    NotAvailable,
}

impl StageError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Format(e) => e.hint(),
            Self::Body(e) => e.hint(),
            Self::Fit(e) => e.hint(),
            Self::NotAvailable => None,
        }
    }

    /// Whether the command asked for what cannot be, rather than failed at its work.
    pub(super) fn is_wrong_command(&self) -> bool {
        matches!(self, Self::Format(FormatError::UnknownExtension { .. }))
    }
}
