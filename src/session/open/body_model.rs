//! The body model of a session.

use super::session::Session;
use super::source;
use crate::body::{BodyModel, EMBEDDED_MODEL_FILE, Figure, StoredFigure, embedded_model, read_model};
use crate::session::error::SessionError;
use crate::session::store::{ContentHash, Kept};
use serde_json::{Value, json};
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

    /// The body model among the inputs of a stage.
    pub(in crate::session) fn body_model_input(&self) -> Value {
        match &self.recipe.body {
            None => json!({ "embedded": ContentHash::of(EMBEDDED_MODEL_FILE) }),
            Some(file) => json!({ "file": file.hash }),
        }
    }

    /// Loads the body model.
    pub(in crate::session) fn body_model(&self) -> Result<BodyModel, SessionError> {
        match &self.recipe.body {
            None => read_body_model(None),
            Some(file) => read(&self.resolve(&file.file), &self.source_bytes(file)?),
        }
    }

    /// Loads a figure, with the corrective offsets of the body model.
    pub(in crate::session) fn figure(&self, kept: Kept<Figure>) -> Result<Figure, SessionError> {
        let stored = self.store.load(Kept::<StoredFigure>::named(kept.hash))?;
        let model = if stored.needs_offsets() { Some(self.body_model()?) } else { None };
        let offsets = model.as_ref().and_then(|model| model.weights.pose_dirs());
        stored.with_offsets(offsets).ok_or_else(|| SessionError::Internal {
            what: "a figure follows corrective offsets that its body model does not have".into(),
        })
    }
}

/// Checks that the bytes are a body model.
pub(in crate::session) fn check_body_model(path: &Path, bytes: &[u8]) -> Result<(), SessionError> {
    read(path, bytes).map(drop)
}

/// The model from a file, or the embedded one.
pub fn read_body_model(path: Option<&Path>) -> Result<BodyModel, SessionError> {
    match path {
        None => embedded_model().map_err(|e| SessionError::bad_source(Path::new("the embedded body model"), e)),
        Some(path) => read(path, &source::read(path)?),
    }
}

fn read(path: &Path, bytes: &[u8]) -> Result<BodyModel, SessionError> {
    read_model(Cursor::new(bytes)).map_err(|e| SessionError::bad_source(path, e))
}
