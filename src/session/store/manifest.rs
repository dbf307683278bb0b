//! `outputs.json`: the result files of a session by absolute path, with the hash of their content.
//!
//! A file that still has this content may be replaced; any other belongs to the user. Not part of the recipe, the state
//! or the history; losing it costs a `--force`.

use super::durable::{place_whole, read_file};
use super::hash::ContentHash;
use crate::session::error::SessionError;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The file's name.
pub(in crate::session) const MANIFEST: &str = "outputs.json";

const VERSION: u32 = 1;

/// The written result files.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::session) struct Manifest {
    version: u32,
    files: BTreeMap<String, ContentHash>,
}

impl Default for Manifest {
    fn default() -> Self {
        Self { version: VERSION, files: BTreeMap::new() }
    }
}

impl Manifest {
    /// The manifest's path in a folder.
    pub fn path_in(dir: &Path) -> PathBuf {
        dir.join(MANIFEST)
    }

    /// Reads the manifest; a missing one is empty.
    ///
    /// **Errors** with one sentence if it is not a valid manifest.
    pub fn read(dir: &Path) -> Result<Self, String> {
        let bytes = match read_file(&Self::path_in(dir)) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Self::default()),
            Err(e) => return Err(e.to_string()),
        };
        match serde_json::from_slice::<Self>(&bytes) {
            Ok(manifest) if manifest.version == VERSION => Ok(manifest),
            Ok(manifest) => Err(format!("it has layout {}, but this program reads only {VERSION}", manifest.version)),
            Err(e) => Err(e.to_string()),
        }
    }

    /// Writes the manifest atomically.
    pub fn write(&self, dir: &Path) -> Result<(), SessionError> {
        let text = serde_json::to_string_pretty(self).map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
        place_whole(&Self::path_in(dir), (text + "\n").as_bytes())
    }

    /// Whether this content was written to this path.
    pub fn lists(&self, place: &Path, content: ContentHash) -> bool {
        self.files.get(place.to_string_lossy().as_ref()) == Some(&content)
    }

    /// Records a written file.
    pub fn note(&mut self, place: &Path, content: ContentHash) {
        self.files.insert(place.to_string_lossy().into_owned(), content);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_written_is_listed_and_a_damaged_manifest_is_an_error() {
        let dir = tempfile::tempdir().unwrap();
        let place = dir.path().join("a.glb");
        assert_eq!(Manifest::read(dir.path()), Ok(Manifest::default()));
        let mut manifest = Manifest::default();
        manifest.note(&place, ContentHash::of(b"one"));
        manifest.write(dir.path()).unwrap();
        let read = Manifest::read(dir.path()).unwrap();
        assert!(read.lists(&place, ContentHash::of(b"one")) && !read.lists(&place, ContentHash::of(b"two")));
        for damaged in ["", "{", "{\"version\":7,\"files\":{}}", "[]"] {
            std::fs::write(Manifest::path_in(dir.path()), damaged).unwrap();
            assert!(Manifest::read(dir.path()).is_err(), "{damaged}");
        }
    }
}
