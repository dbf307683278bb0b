//! What was derived from results and can be derived again: kept by name beside the artefacts, so that it is fast the next
//! time. No change of the session is recorded for it.

use super::durable::write_lightly;
use super::hash::ContentHash;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::{Path, PathBuf};

/// The folder `derived` of a session.
pub(in crate::session) struct Derived {
    folder: PathBuf,
}

/// What is kept: for which inputs, and the hash of the bytes that follow.
#[derive(serde::Deserialize, Serialize)]
struct Header {
    inputs: String,
    content: String,
}

impl Derived {
    /// Its name in a session.
    pub const FOLDER: &str = "derived";

    pub(super) fn beside(artefacts: &Path) -> Self {
        Self { folder: artefacts.with_file_name(Self::FOLDER) }
    }

    /// What is kept under that name, if it was derived from these inputs and is sound.
    pub fn load<T: DeserializeOwned>(&self, name: &str, inputs: ContentHash) -> Option<T> {
        let bytes = std::fs::read(self.folder.join(name)).ok()?;
        let (header, content): (Header, &[u8]) = postcard::take_from_bytes(&bytes).ok()?;
        let is_sound = header.inputs == inputs.to_string() && header.content == ContentHash::of(content).to_string();
        if is_sound { postcard::from_bytes(content).ok() } else { None }
    }

    /// Removes what is kept under a name. **Returns** whether there was something.
    pub fn remove(&self, name: &str) -> bool {
        std::fs::remove_file(self.folder.join(name)).is_ok()
    }

    /// Keeps a value under a name, in place of an earlier one. A value that cannot be kept is only derived again.
    pub fn keep<T: Serialize>(&self, name: &str, inputs: ContentHash, value: &T) {
        let Ok(content) = postcard::to_stdvec(value) else { return };
        let header = Header { inputs: inputs.to_string(), content: ContentHash::of(&content).to_string() };
        let Ok(mut bytes) = postcard::to_stdvec(&header) else { return };
        bytes.extend(content);
        if std::fs::create_dir_all(&self.folder).is_ok() {
            let _ = write_lightly(&self.folder.join(name), &bytes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_comes_back_for_its_own_inputs_only_and_never_damaged() {
        let dir = tempfile::tempdir().unwrap();
        let derived = Derived::beside(&dir.path().join("artefacts"));
        let [one, other] = [b"one", b"two"].map(|b| ContentHash::of(b));
        assert_eq!(derived.load::<Vec<u32>>("a", one), None);
        derived.keep("a", one, &vec![7u32, 8]);
        assert_eq!(derived.load::<Vec<u32>>("a", one), Some(vec![7, 8]));
        assert_eq!(derived.load::<Vec<u32>>("a", other), None);
        let path = dir.path().join("derived").join("a");
        let mut bytes = std::fs::read(&path).unwrap();
        *bytes.last_mut().unwrap() ^= 1;
        std::fs::write(&path, &bytes).unwrap();
        assert_eq!(derived.load::<Vec<u32>>("a", one), None, "damaged");
        derived.keep("a", other, &vec![9u32]);
        assert_eq!(derived.load::<Vec<u32>>("a", other), Some(vec![9]), "in place of what was there");
    }
}
