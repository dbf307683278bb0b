//! Input files: copied to the artefacts under the hash of their bytes, so that a session does not depend on them.

use super::input::Input;
use super::session::Session;
use crate::formats::{FormatError, MeshKind, RawMesh};
use crate::session::error::SessionError;
use crate::session::recipe::{Recipe, SourceFile, relative_to};
use crate::session::store::{ContentHash, read_file};
use std::path::Path;

/// Reads a file; nothing is kept yet.
///
/// **Errors** also for a folder, a FIFO and a device.
pub fn read(path: &Path) -> Result<Vec<u8>, SessionError> {
    read_file(path).map_err(|e| SessionError::reading(path, e))
}

/// Reads a mesh with the files beside it that it names.
pub fn read_mesh_file(path: &Path) -> Result<RawMesh, SessionError> {
    // Before the file is looked at: another extension is a wrong command.
    let extension = path.extension().unwrap_or_default().to_string_lossy().into_owned();
    MeshKind::from_extension(&extension).map_err(|e: FormatError| SessionError::bad_source(path, e))?;
    Input::at(path)?.mesh(path)
}

/// The recipe's entry for content read from `path`; stores nothing.
pub(in crate::session) fn named(dir: &Path, path: &Path, hash: ContentHash) -> Result<SourceFile, SessionError> {
    Ok(SourceFile { file: relative_to(dir, path)?, hash: Some(hash), ..SourceFile::default() })
}

impl Session {
    /// The content of a file of the recipe: the session's copy, or the file itself if the recipe was written by hand.
    pub(in crate::session) fn input(&self, source: &SourceFile) -> Result<Input, SessionError> {
        Input::of(&self.store, &self.resolve(&source.file), source.hash)
    }

    /// The hash of the content of a file of the recipe.
    pub(in crate::session) fn source_hash(&self, source: &SourceFile) -> Result<ContentHash, SessionError> {
        source.hash.map_or_else(|| self.input(source)?.hash(), Ok)
    }

    /// Whether the input file is unchanged, with all files beside it that belong to it.
    pub(in crate::session) fn source_is_as_it_was(&self, source: &SourceFile) -> bool {
        let path = self.resolve(&source.file);
        match source.hash {
            Some(hash) => matches!(Input::unchanged(&path, hash), Ok(Some(_))),
            None => Input::at(&path).is_ok(),
        }
    }
}

/// Fills in the hashes that a recipe written by hand omits, and stores the missing copies.
pub(in crate::session) fn keep_missing(session: &mut Session) -> Result<(), SessionError> {
    let mut recipe = session.recipe.clone();
    fill_in(&mut recipe, session)?;
    session.recipe = recipe;
    Ok(())
}

/// Fills in the hashes of a new recipe, and stores the missing copies.
pub(in crate::session) fn fill_in(recipe: &mut Recipe, session: &Session) -> Result<(), SessionError> {
    let keep = |source: SourceFile| -> Result<Option<ContentHash>, SessionError> {
        if source.hash.is_some_and(|hash| session.store.has(hash)) {
            return Ok(source.hash);
        }
        let input = session.input(&source)?;
        let hash = source.hash.map_or_else(|| input.hash(), Ok)?;
        input.keep(&session.store, hash)?;
        Ok(Some(hash))
    };
    if let Some(body) = &mut recipe.body {
        body.hash = keep(body.clone())?;
    }
    for kind in &mut recipe.templates {
        kind.hash = keep(kind.source())?;
    }
    for step in &mut recipe.steps {
        step.hash = keep(step.source())?;
        for mask in &mut step.masks {
            mask.hash = keep(mask.clone())?;
        }
    }
    for animation in &mut recipe.animations {
        if let Some(source) = animation.source() {
            animation.hash = keep(source)?;
        }
    }
    Ok(())
}
