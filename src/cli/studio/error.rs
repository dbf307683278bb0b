//! Why a synthetic session cannot be written.

use crate::formats::FormatError;
use crate::session::SessionError;
use crate::studio::StudioError;

/// Why a synthetic session cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum MakeError {
    /// The folder is not empty, or a file in it cannot be written.
    #[error(transparent)]
    File(#[from] SessionError),
    /// The request cannot be generated.
    #[error(transparent)]
    Refused(#[from] StudioError),
    /// An image or a mesh cannot be encoded.
    #[error("the session cannot be written: {0}")]
    Encoding(#[from] FormatError),
}

impl MakeError {
    /// Whether the arguments are wrong; otherwise the work failed.
    pub fn is_wrong_command(&self) -> bool {
        match self {
            Self::File(error) => error.is_wrong_command(),
            Self::Refused(_) => true,
            Self::Encoding(_) => false,
        }
    }

    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::File(error) => error.hint(),
            Self::Refused(error) => Some(error.hint().unwrap_or_default()),
            Self::Encoding(_) => None,
        }
    }
}
