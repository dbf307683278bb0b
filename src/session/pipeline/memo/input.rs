//! Files and body models among the inputs of a stage.

use crate::body::{BodyModel, EMBEDDED_MODEL_FILE, Figure, ModelLicense, StoredFigure};
use crate::formats::RawMesh;
use crate::session::error::SessionError;
use crate::session::open::{Input, ScanInput, Session, parse_body_model, read_body_model};
use crate::session::recipe::SourceFile;
use crate::session::stage_error::StageError;
use crate::session::store::{ContentHash, Kept, Store};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A file: an input by its content and by its extension, which says how it is read.
#[derive(Clone, Debug, Serialize)]
pub(in crate::session) struct FileInput {
    /// `None` in a recipe written by hand, before a build.
    hash: Option<ContentHash>,
    extension: Option<String>,
    /// Where the content is found if the session has no copy yet, and for messages. No result depends on it.
    #[serde(skip)]
    path: PathBuf,
}

impl FileInput {
    pub fn of(session: &Session, source: &SourceFile) -> Self {
        Self::at(session.resolve(&source.file), source.hash)
    }

    pub fn at(path: PathBuf, hash: Option<ContentHash>) -> Self {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        Self { hash, extension, path }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn open(&self, store: &Store) -> Result<Input, SessionError> {
        Input::of(store, &self.path, self.hash)
    }

    pub fn bytes(&self, store: &Store) -> Result<Vec<u8>, SessionError> {
        self.open(store)?.bytes()
    }

    /// The mesh in the file, in full detail; `None` for a recording of frames.
    pub fn mesh(&self, store: &Store) -> Result<Option<RawMesh>, SessionError> {
        match self.open(store)?.scan(&self.path)? {
            ScanInput::Mesh(raw) => Ok(Some(*raw)),
            ScanInput::Frames(_) => Ok(None),
        }
    }

    /// Stores a copy of the content.
    pub fn keep(&self, content: &Input, store: &Store) -> Result<(), SessionError> {
        content.keep(store, self.hash.map_or_else(|| content.hash(), Ok)?)
    }

    /// The error of the file.
    pub fn fault(&self, source: impl Into<StageError>) -> SessionError {
        SessionError::bad_source(&self.path, source)
    }
}

/// The body model of a session.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub(in crate::session) enum ModelInput {
    Embedded(ContentHash),
    File(FileInput),
}

impl ModelInput {
    pub fn of(session: &Session) -> Self {
        match &session.recipe.body {
            None => Self::Embedded(ContentHash::of(EMBEDDED_MODEL_FILE)),
            Some(file) => Self::File(FileInput::of(session, file)),
        }
    }

    pub fn load(&self, store: &Store) -> Result<BodyModel, SessionError> {
        match self {
            Self::Embedded(_) => read_body_model(None),
            Self::File(file) => parse_body_model(file.path(), &file.bytes(store)?),
        }
    }

    /// The licence of the body model.
    pub fn license(&self, store: &Store) -> Result<ModelLicense, SessionError> {
        match self {
            Self::Embedded(_) => Ok(ModelLicense::of_embedded_model()),
            Self::File(file) => ModelLicense::read(std::io::Cursor::new(file.bytes(store)?))
                .map_err(|e| SessionError::bad_source(file.path(), e)),
        }
    }

    /// Loads a figure, with the corrective offsets of the body model.
    pub fn figure(&self, store: &Store, kept: Kept<Figure>) -> Result<Figure, SessionError> {
        let stored = store.load(Kept::<StoredFigure>::named(kept.hash))?;
        let model = if stored.needs_offsets() { Some(self.load(store)?) } else { None };
        let offsets = model.as_ref().and_then(|model| model.weights.pose_dirs());
        stored.with_offsets(offsets).ok_or_else(|| SessionError::Internal {
            what: "a figure follows corrective offsets that its body model does not have".into(),
        })
    }
}

impl ModelInput {
    /// Like [`ModelInput::figure`], or from memory.
    pub fn figure_shared(&self, store: &Store, kept: Kept<Figure>) -> Result<Arc<Figure>, SessionError> {
        store.made(kept.hash, || self.figure(store, kept))
    }
}

impl Session {
    /// Loads the body model.
    pub(in crate::session) fn body_model(&self) -> Result<BodyModel, SessionError> {
        ModelInput::of(self).load(&self.store)
    }

    /// The licence of the body model.
    pub(in crate::session) fn model_license(&self) -> Result<ModelLicense, SessionError> {
        ModelInput::of(self).license(&self.store)
    }

    /// Loads a figure, with the corrective offsets of the body model.
    pub(in crate::session) fn figure(&self, kept: Kept<Figure>) -> Result<Figure, SessionError> {
        ModelInput::of(self).figure(&self.store, kept)
    }
}
