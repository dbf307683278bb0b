//! Errors of `overcoat drive`.

use crate::body::BodyError;
use crate::cloth::ClothError;
use crate::drive::{DriveError, StreamError};
use crate::motion::MotionError;

/// Why a stream ended, or could not begin.
#[derive(Debug, thiserror::Error)]
pub(in crate::cli) enum DriveFailure {
    #[error(transparent)]
    Stream(#[from] StreamError),
    #[error(transparent)]
    Drive(#[from] DriveError),
    #[error(transparent)]
    Model(#[from] BodyError),
    #[error(transparent)]
    Motion(#[from] MotionError),
    #[error(transparent)]
    Cloth(#[from] ClothError),
    #[error("no frame was read before the program was stopped")]
    Nothing,
}

impl DriveFailure {
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Stream(error) => error.hint(),
            Self::Drive(error) => error.hint(),
            Self::Model(error) => error.hint(),
            Self::Motion(error) => error.hint(),
            Self::Cloth(_) => None,
            Self::Nothing => Some("check that the tracker writes to the pipe".into()),
        }
    }
}
