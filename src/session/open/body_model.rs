//! The body model of a session.

use super::session::Session;
use super::source;
use crate::body::{BodyModel, embedded_model, read_model};
use crate::session::error::SessionError;
use std::io::Cursor;
use std::path::Path;

/// Origin of the body model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BodyModelSource {
    /// The model embedded in the program.
    Embedded,
    /// A file, by its path in the recipe.
    File(String),
}

impl Session {
    /// Origin of this session's body model.
    pub fn body_model_source(&self) -> BodyModelSource {
        match &self.recipe.body {
            None => BodyModelSource::Embedded,
            Some(file) => BodyModelSource::File(file.file.clone()),
        }
    }
}

/// Checks that the bytes are a body model.
pub(in crate::session) fn check_body_model(path: &Path, bytes: &[u8]) -> Result<(), SessionError> {
    parse_body_model(path, bytes).map(drop)
}

/// The model from a file, or the embedded one.
pub fn read_body_model(path: Option<&Path>) -> Result<BodyModel, SessionError> {
    match path {
        None => embedded_model().map_err(|e| SessionError::bad_source(Path::new("the embedded body model"), e)),
        Some(path) => parse_body_model(path, &source::read(path)?),
    }
}

/// The model in the bytes of a file; `path` is for messages.
pub(in crate::session) fn parse_body_model(path: &Path, bytes: &[u8]) -> Result<BodyModel, SessionError> {
    read_model(Cursor::new(bytes)).map_err(|e| SessionError::bad_source(path, e))
}
