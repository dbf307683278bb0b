//! What the function of a stage returns.

use super::event::Outcome;
use crate::session::error::SessionError;
use crate::session::stage_error::StageError;
use std::path::PathBuf;

/// Why a stage failed; [`At`](super::at::At) adds where.
pub(in crate::session) enum RunError {
    /// In the module of the stage.
    Stage(StageError),
    /// A mask leaves nothing of the garment.
    NothingLeft(PathBuf),
    /// An error that says itself where: of a file, or of the store.
    Session(SessionError),
}

impl<E: Into<StageError>> From<E> for RunError {
    fn from(error: E) -> Self {
        Self::Stage(error.into())
    }
}

impl From<SessionError> for RunError {
    fn from(error: SessionError) -> Self {
        Self::Session(error)
    }
}

/// What the function of a stage returns.
pub(in crate::session) type Run<T> = Result<Outcome<T>, RunError>;
