//! Files that were given: copied among the artefacts under the hash of their bytes, so that a session outlives them.

use super::open::Session;
use super::recipe::{Recipe, SourceFile, relative_to};
use super::{ContentHash, SessionError};
use std::path::Path;

/// Reads a file; nothing is kept yet.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, SessionError> {
    if path.is_dir() {
        return Err(SessionError::BadRequest {
            what: format!("'{}' is a folder", path.display()),
            hint: "name one file; folders of RGB-D frames cannot be read yet".into(),
        });
    }
    std::fs::read(path).map_err(|e| SessionError::reading(path, e))
}

/// What a recipe says of bytes that were read from `path`; nothing is kept yet.
pub(super) fn named(dir: &Path, path: &Path, bytes: &[u8]) -> Result<SourceFile, SessionError> {
    Ok(SourceFile { file: relative_to(dir, path)?, hash: Some(ContentHash::of(bytes)) })
}

impl Session {
    /// The bytes of a file of the recipe: the session's copy, or the file itself where a recipe was written by hand.
    pub(super) fn source_bytes(&self, source: &SourceFile) -> Result<Vec<u8>, SessionError> {
        let Some(hash) = source.hash else { return read(&self.resolve(&source.file)) };
        let copy = self.store.bytes(hash);
        let path = self.resolve(&source.file);
        let no_copy = match copy {
            Ok(bytes) => return Ok(bytes),
            Err(e) => e,
        };
        match read(&path) {
            Ok(bytes) if ContentHash::of(&bytes) == hash => Ok(bytes),
            Ok(_) => Err(SessionError::SourceChanged { path }),
            Err(_) if self.store.has(hash) => Err(no_copy),
            Err(no_file) => Err(no_file),
        }
    }
}

impl Session {
    /// Whether the file that was given still holds what it held.
    pub(super) fn source_is_as_it_was(&self, source: &SourceFile) -> bool {
        match (source.hash, std::fs::read(self.resolve(&source.file))) {
            (Some(hash), Ok(bytes)) => ContentHash::of(&bytes) == hash,
            (None, Ok(_)) => true,
            (_, Err(_)) => false,
        }
    }
}

/// Fills in the hashes that a recipe written by hand leaves out, and keeps the copies that the session lacks.
pub(super) fn keep_missing(session: &mut Session) -> Result<(), SessionError> {
    let mut recipe = session.recipe.clone();
    fill_in(&mut recipe, session)?;
    session.recipe = recipe;
    Ok(())
}

/// The same for a recipe that is not the session's yet.
pub(super) fn fill_in(recipe: &mut Recipe, session: &Session) -> Result<(), SessionError> {
    let keep = |source: SourceFile| -> Result<Option<ContentHash>, SessionError> {
        if source.hash.is_some_and(|hash| session.store.has(hash)) {
            return Ok(source.hash);
        }
        Ok(Some(session.store.keep_bytes(&session.source_bytes(&source)?)?))
    };
    if let Some(body) = &mut recipe.body {
        body.hash = keep(body.clone())?;
    }
    for step in &mut recipe.steps {
        step.hash = keep(step.source())?;
        for mask in &mut step.masks {
            mask.hash = keep(mask.clone())?;
        }
    }
    Ok(())
}
