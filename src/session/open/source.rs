//! Input files: copied to the artefacts under the hash of their bytes, so that a session does not depend on them.

use super::session::Session;
use crate::formats::{recording_files, write_recording};
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

/// Reads a scan: a file, or a folder of RGB-D frames as one zip; nothing is kept yet.
pub(in crate::session) fn read_scan(path: &Path) -> Result<Vec<u8>, SessionError> {
    if path.is_dir() { packed(path) } else { read(path) }
}

/// The files of an RGB-D recording in one zip: camera, lists of frames, images. Equal files give equal bytes; other
/// files in the folder are ignored.
fn packed(dir: &Path) -> Result<Vec<u8>, SessionError> {
    let names = names_in(dir)?;
    let mut text = |name: &str| read_file(&dir.join(name)).ok();
    let needed = recording_files(&names, &mut text).map_err(|e| SessionError::bad_source(dir, e))?;
    let mut files = Vec::with_capacity(needed.len());
    for name in needed {
        let path = dir.join(&name);
        let bytes = read(&path)?;
        files.push((name, bytes));
    }
    let mut zip = Vec::new();
    write_recording(&files, &mut zip).map_err(|e| SessionError::bad_source(dir, e))?;
    Ok(zip)
}

/// Names of the files in a folder and in the folders directly in it, sorted.
fn names_in(dir: &Path) -> Result<Vec<String>, SessionError> {
    let mut names = Vec::new();
    let entries = |dir: &Path| std::fs::read_dir(dir).map_err(|e| SessionError::reading(dir, e));
    for entry in entries(dir)? {
        let entry = entry.map_err(|e| SessionError::reading(dir, e))?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.path().is_dir() {
            for inside in entries(&entry.path())? {
                let inside = inside.map_err(|e| SessionError::reading(&entry.path(), e))?;
                if inside.path().is_file() {
                    names.push(format!("{name}/{}", inside.file_name().to_string_lossy()));
                }
            }
        } else {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

/// The recipe's entry for bytes read from `path`; stores nothing.
pub(in crate::session) fn named(dir: &Path, path: &Path, bytes: &[u8]) -> Result<SourceFile, SessionError> {
    Ok(SourceFile { file: relative_to(dir, path)?, hash: Some(ContentHash::of(bytes)), ..SourceFile::default() })
}

impl Session {
    /// The bytes of a file of the recipe: the session's copy, or the file itself if the recipe was written by hand.
    pub(in crate::session) fn source_bytes(&self, source: &SourceFile) -> Result<Vec<u8>, SessionError> {
        let Some(hash) = source.hash else { return read_scan(&self.resolve(&source.file)) };
        let copy = self.store.bytes(hash);
        let path = self.resolve(&source.file);
        let no_copy = match copy {
            Ok(bytes) => return Ok(bytes),
            Err(e) => e,
        };
        match read_scan(&path) {
            Ok(bytes) if ContentHash::of(&bytes) == hash => Ok(bytes),
            Ok(_) => Err(SessionError::SourceChanged { path }),
            Err(_) if self.store.has(hash) => Err(no_copy),
            Err(no_file) => Err(no_file),
        }
    }
}

impl Session {
    /// Whether the input file is unchanged.
    pub(in crate::session) fn source_is_as_it_was(&self, source: &SourceFile) -> bool {
        match (source.hash, read_scan(&self.resolve(&source.file))) {
            (Some(hash), Ok(bytes)) => ContentHash::of(&bytes) == hash,
            (None, Ok(_)) => true,
            (_, Err(_)) => false,
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
        Ok(Some(session.store.keep_bytes(&session.source_bytes(&source)?)?))
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
    Ok(())
}
