//! The answers about a garment that `record` has asked for and that is not scanned yet, so that the prompt can be left
//! and resumed at any point. They are not part of the session's state; losing them costs the user two answers.

use super::session::Session;
use crate::session::error::SessionError;
use crate::session::store::{read_file, write_whole};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The answers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Draft {
    /// The garment's name.
    pub name: String,
    /// Its kind, and the options of `scan` as typed.
    #[serde(default)]
    pub kind: Option<Vec<String>>,
}

impl Session {
    fn draft_path(&self) -> PathBuf {
        self.dir().join("record.json")
    }

    /// The draft; `None` if it does not exist, cannot be read, or was scanned since.
    pub fn draft(&self) -> Option<Draft> {
        let draft: Draft = serde_json::from_slice(&read_file(&self.draft_path()).ok()?).ok()?;
        self.recipe.step(&draft.name).is_err().then_some(draft)
    }

    /// Writes or deletes the draft.
    pub fn keep_draft(&self, draft: Option<&Draft>) -> Result<(), SessionError> {
        let path = self.draft_path();
        match draft {
            Some(draft) => {
                let text =
                    serde_json::to_string(draft).map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
                write_whole(&path, (text + "\n").as_bytes())
            }
            None => match std::fs::remove_file(&path) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(SessionError::writing(&path, e)),
                _ => Ok(()),
            },
        }
    }
}
