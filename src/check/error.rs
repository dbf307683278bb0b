//! What a check refuses.

use thiserror::Error;

/// The results of a step do not belong together.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum CheckError {
    /// An array has another length than the surface that it describes.
    #[error("{what}: {given} values, but the surface has {expected} vertices")]
    WrongLength {
        /// The array.
        what: &'static str,
        /// Its length.
        given: usize,
        /// The number of vertices.
        expected: usize,
    },
    /// There is no body to compare with.
    #[error("a figure without a body cannot be checked")]
    NoBody,
}

impl CheckError {
    pub(super) fn require_length(what: &'static str, given: usize, expected: usize) -> Result<(), Self> {
        if given == expected { Ok(()) } else { Err(Self::WrongLength { what, given, expected }) }
    }
}
