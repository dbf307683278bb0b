//! Why a command on body models fails.

use crate::session::{SessionError, StageError};
use std::path::{Path, PathBuf};

/// Why a command on body models fails.
#[derive(Debug, thiserror::Error)]
pub enum BodiesError {
    /// A file cannot be read or written.
    #[error(transparent)]
    File(#[from] SessionError),
    /// A file next to a mesh is not in its format.
    #[error("{}{}: {reason}", path.display(), line.map(|l| format!(", line {l}")).unwrap_or_default())]
    BadFile {
        /// The file.
        path: PathBuf,
        /// The line, if the error has one.
        line: Option<usize>,
        /// What is wrong.
        reason: String,
        /// What to do.
        hint: String,
    },
    /// The content of a file is invalid, or the computation with it fails.
    #[error("'{}': {source}", path.display())]
    BadSource {
        /// The file.
        path: PathBuf,
        /// The error of the module that read it.
        source: Box<StageError>,
    },
    /// The arguments are invalid.
    #[error("{what}")]
    BadRequest {
        /// One sentence.
        what: String,
        /// What to do.
        hint: String,
    },
}

impl BodiesError {
    pub(super) fn bad_source(path: &Path, source: impl Into<StageError>) -> Self {
        Self::BadSource { path: path.to_path_buf(), source: Box::new(source.into()) }
    }

    pub(super) fn reading(path: &Path, source: std::io::Error) -> Self {
        Self::File(SessionError::reading(path, source))
    }

    /// Whether the arguments are wrong; otherwise the work failed.
    pub fn is_wrong_command(&self) -> bool {
        match self {
            Self::File(error) => error.is_wrong_command(),
            Self::BadSource { source, .. } => source.is_wrong_command(),
            Self::BadRequest { .. } => true,
            Self::BadFile { .. } => false,
        }
    }

    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::File(error) => error.hint(),
            Self::BadSource { source, .. } => source.hint(),
            Self::BadFile { hint, .. } | Self::BadRequest { hint, .. } => Some(hint.clone()),
        }
    }
}
