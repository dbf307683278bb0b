//! Artefacts by the hash of their content.

use super::derived::Derived;
use super::durable::{place, place_whole, sweep, sync_folder};
use super::hash::{ContentHash, HashingWriter};
use super::memory::Memory;
use super::stream::StreamError;
use crate::session::error::SessionError;
use serde::de::DeserializeOwned;
use serde::{Serialize, Serializer};
use std::fs::File;
use std::io::{BufWriter, Seek, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The folder `artefacts` of a session.
///
/// **Guarantees** a name is the hash of its content, checked on every read; a file is whole or absent.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
    memory: Option<Memory>,
}

/// The health of an artefact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::session) enum Health {
    Sound,
    Missing,
    Damaged,
}

/// An artefact of a known type, not loaded.
#[derive(Debug)]
pub struct Kept<T> {
    /// Its name in the store.
    pub hash: ContentHash,
    of_type: PhantomData<fn() -> T>,
}

impl<T> Clone for Kept<T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T> Copy for Kept<T> {}

/// As an input of a stage, an artefact is its name.
impl<T> Serialize for Kept<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.hash.serialize(serializer)
    }
}

impl<T> Kept<T> {
    /// Asserts that the artefact of that name is a `T`; the hash of a stage's inputs guarantees it.
    pub(in crate::session) fn named(hash: ContentHash) -> Self {
        Self { hash, of_type: PhantomData }
    }
}

impl Store {
    pub(in crate::session) fn in_session(dir: &Path) -> Self {
        Self { folder: dir.join("artefacts"), memory: None }
    }

    pub(in crate::session) fn create(&self) -> Result<(), SessionError> {
        std::fs::create_dir_all(&self.folder).map_err(|e| SessionError::writing(&self.folder, e))
    }

    pub(in crate::session) fn sweep(&self) {
        sweep(&self.folder);
        sweep(&self.folder.with_file_name(Derived::FOLDER));
    }

    /// Stores bytes. They become durable when the store is settled; every change of the session does this before it
    /// refers to them.
    pub fn keep_bytes(&self, bytes: &[u8]) -> Result<ContentHash, SessionError> {
        let hash = ContentHash::of(bytes);
        let path = self.path(hash);
        // A sound artefact is not written again; writing repairs a damaged one.
        if self.health(hash) != Health::Sound {
            place_whole(&path, bytes)?;
        }
        Ok(hash)
    }

    /// Stores what `write` writes, like [`Store::keep_bytes`], without holding it in memory.
    ///
    /// **Errors** `other` if it does not have the hash; then nothing is stored.
    pub(in crate::session) fn keep_stream(
        &self,
        hash: ContentHash,
        other: impl FnOnce() -> SessionError,
        write: impl FnOnce(&mut dyn Write) -> Result<(), StreamError>,
    ) -> Result<(), SessionError> {
        if self.health(hash) == Health::Sound {
            return Ok(());
        }
        let path = self.path(hash);
        place(&path, |file| {
            let mut out = HashingWriter::new(BufWriter::new(file));
            write(&mut out).map_err(|e| e.in_file(&path))?;
            out.flush().map_err(|e| SessionError::writing(&path, e))?;
            if out.hash() == hash { Ok(()) } else { Err(other()) }
        })
    }

    /// The artefact of that name as a file, its content checked.
    pub(in crate::session) fn open(&self, hash: ContentHash) -> Result<File, SessionError> {
        let path = self.path(hash);
        let reading = |e: std::io::Error| match e.kind() {
            std::io::ErrorKind::NotFound => {
                SessionError::DamagedArtefact { path: path.clone(), reason: "it is missing" }
            }
            _ => SessionError::reading(&path, e),
        };
        let mut file = File::open(&path).map_err(reading)?;
        if ContentHash::of_stream(&file).map_err(reading)? != hash {
            return Err(SessionError::DamagedArtefact { path, reason: "its content has changed" });
        }
        file.rewind().map_err(reading)?;
        Ok(file)
    }

    /// Makes the stored bytes durable.
    pub(in crate::session) fn settle(&self) -> Result<(), SessionError> {
        sync_folder(&self.folder)
    }

    /// The bytes of that name.
    pub fn bytes(&self, hash: ContentHash) -> Result<Vec<u8>, SessionError> {
        let path = self.path(hash);
        let bytes = std::fs::read(&path).map_err(|e| match e.kind() {
            std::io::ErrorKind::NotFound => {
                SessionError::DamagedArtefact { path: path.clone(), reason: "it is missing" }
            }
            _ => SessionError::reading(&path, e),
        })?;
        if ContentHash::of(&bytes) != hash {
            return Err(SessionError::DamagedArtefact { path, reason: "its content has changed" });
        }
        Ok(bytes)
    }

    /// The text of that name: a recipe or a state.
    pub(in crate::session) fn text(&self, hash: ContentHash) -> Result<String, SessionError> {
        // Content with the right hash was written by this program, as text.
        Ok(String::from_utf8_lossy(&self.bytes(hash)?).into_owned())
    }

    /// The health of an artefact, by its content.
    pub(in crate::session) fn health(&self, hash: ContentHash) -> Health {
        match File::open(self.path(hash)).and_then(ContentHash::of_stream) {
            Ok(found) if found == hash => Health::Sound,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Health::Missing,
            _ => Health::Damaged,
        }
    }

    /// Deletes an artefact; if that fails, the next run overwrites it.
    pub(in crate::session) fn remove(&self, hash: ContentHash) {
        let _ = std::fs::remove_file(self.path(hash));
    }

    /// All names in the folder, in order.
    pub(in crate::session) fn names(&self) -> Result<Vec<ContentHash>, SessionError> {
        let entries = match std::fs::read_dir(&self.folder) {
            Ok(entries) => entries,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(e) => return Err(SessionError::reading(&self.folder, e)),
        };
        let mut names: Vec<String> = entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        Ok(names.iter().filter_map(|name| ContentHash::parse(name)).collect())
    }

    /// Stores a value in postcard's layout.
    pub fn keep<T: Serialize>(&self, value: &T) -> Result<Kept<T>, SessionError> {
        let bytes = postcard::to_stdvec(value).map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
        Ok(Kept::named(self.keep_bytes(&bytes)?))
    }

    /// Loads a value.
    pub fn load<T: DeserializeOwned>(&self, kept: Kept<T>) -> Result<T, SessionError> {
        let bytes = self.bytes(kept.hash)?;
        postcard::from_bytes(&bytes).map_err(|_| SessionError::DamagedArtefact {
            path: self.path(kept.hash),
            reason: "another version of Overcoat wrote it",
        })
    }

    /// Caches loaded values in `memory` from now on.
    pub(in crate::session) fn remember(&mut self, memory: &Memory) {
        self.memory = Some(memory.clone());
    }

    /// Loads a value, or takes it from memory.
    pub(in crate::session) fn load_shared<T: DeserializeOwned + Send + Sync + 'static>(
        &self,
        kept: Kept<T>,
    ) -> Result<Arc<T>, SessionError> {
        match &self.memory {
            Some(memory) => memory.have(kept.hash, || self.load(kept)),
            None => self.load(kept).map(Arc::new),
        }
    }

    /// A value prepared from the artefact of that name: computed, or taken from memory.
    pub(in crate::session) fn prepared<T: Send + Sync + 'static>(
        &self,
        of: ContentHash,
        prepare: impl FnOnce() -> T,
    ) -> Arc<T> {
        match &self.memory {
            Some(memory) => {
                memory.have(of, || Ok::<T, std::convert::Infallible>(prepare())).unwrap_or_else(|e| match e {})
            }
            None => Arc::new(prepare()),
        }
    }

    /// Like [`Store::prepared`], for what may fail.
    pub(in crate::session) fn made<T: Send + Sync + 'static, E>(
        &self,
        of: ContentHash,
        make: impl FnOnce() -> Result<T, E>,
    ) -> Result<Arc<T>, E> {
        match &self.memory {
            Some(memory) => memory.have(of, make),
            None => make().map(Arc::new),
        }
    }

    /// What is derived from artefacts, beside them.
    pub(in crate::session) fn derived(&self) -> Derived {
        Derived::beside(&self.folder)
    }

    /// Whether a file of that name exists; its content is checked on reading.
    pub fn has(&self, hash: ContentHash) -> bool {
        self.path(hash).is_file()
    }

    fn path(&self, hash: ContentHash) -> PathBuf {
        self.folder.join(hash.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn store() -> (tempfile::TempDir, Store) {
        let dir = tempfile::tempdir().unwrap();
        let store = Store::in_session(dir.path());
        store.create().unwrap();
        (dir, store)
    }

    #[test]
    fn what_is_kept_comes_back_under_the_same_name() {
        let (_dir, store) = store();
        let value = vec![1.5f64, -0.0, 1e-300];
        let kept = store.keep(&value).unwrap();
        assert_eq!(store.load(kept).unwrap(), value);
        assert_eq!(store.keep(&value).unwrap().hash, kept.hash);
    }

    #[test]
    fn damage_is_seen_and_mended_by_keeping_again() {
        let (dir, store) = store();
        let kept = store.keep(&vec![7u32, 8]).unwrap();
        let path = dir.path().join("artefacts").join(kept.hash.to_string());
        std::fs::write(&path, b"nonsense").unwrap();
        assert!(matches!(store.load(kept), Err(SessionError::DamagedArtefact { .. })));
        store.keep(&vec![7u32, 8]).unwrap();
        assert_eq!(store.load(kept).unwrap(), vec![7, 8]);
        std::fs::remove_file(&path).unwrap();
        assert!(matches!(store.load(kept), Err(SessionError::DamagedArtefact { reason: "it is missing", .. })));
    }
}
