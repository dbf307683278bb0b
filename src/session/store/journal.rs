//! One line per change: what was done, and the hashes of the resulting recipe and state.

use super::durable::{append_line, read_file};
use super::hash::ContentHash;
use crate::session::error::SessionError;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// One change of a session. Recipe and state are artefacts, so every earlier state can be restored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// Description of the change.
    pub change: String,
    /// The text of `recipe.toml` afterwards.
    pub recipe: ContentHash,
    /// The text of `session.json` afterwards.
    pub state: ContentHash,
    /// Set if the line restores an earlier state.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub moves: Option<Move>,
}

/// A line that restores an earlier state.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Move {
    /// Restores the state before the branch's last change.
    Undo,
    /// Restores the state after the change that was undone last.
    Redo,
    /// Switches to the branch of that name; a new one begins here.
    Branch(String),
}

/// The file as it is.
pub(in crate::session) struct Journal {
    /// All changes before the first unreadable line, oldest first.
    pub changes: Vec<Change>,
    /// The first unreadable line.
    pub broken: Option<BrokenLine>,
}

/// An unreadable line.
pub(in crate::session) struct BrokenLine {
    /// Counted from 1.
    pub line: usize,
    /// The reason.
    pub reason: String,
    /// Whether it is an incomplete last line: its writer was stopped, or the file was truncated.
    pub cut_off: bool,
}

/// The length and the time of a journal: another one means that the session was changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JournalLook {
    bytes: u64,
    modified: SystemTime,
}

impl JournalLook {
    /// That of the session in `dir`; `None` if it has none.
    pub fn of(dir: &Path) -> Option<Self> {
        let meta = std::fs::metadata(path_in(dir)).ok()?;
        Some(Self { bytes: meta.len(), modified: meta.modified().ok()? })
    }
}

pub(in crate::session) fn path_in(dir: &Path) -> PathBuf {
    dir.join("journal.jsonl")
}

/// Reads all readable lines. **Errors** if the file cannot be read.
pub(in crate::session) fn read(dir: &Path) -> Result<Journal, SessionError> {
    let path = path_in(dir);
    let bytes = match read_file(&path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Vec::new(),
        Err(e) => return Err(SessionError::reading(&path, e)),
    };
    Ok(parse(&bytes))
}

/// Parses the bytes of a journal.
pub(in crate::session) fn parse(bytes: &[u8]) -> Journal {
    let mut changes = Vec::new();
    for line in bytes.split_inclusive(|&b| b == b'\n') {
        let broken = |reason: String, cut_off| Some(BrokenLine { line: changes.len() + 1, reason, cut_off });
        let Some(whole) = line.strip_suffix(b"\n") else {
            return Journal { broken: broken("the line is cut off".into(), true), changes };
        };
        match serde_json::from_slice(whole) {
            Ok(change) => changes.push(change),
            Err(e) => {
                return Journal { broken: broken(format!("the line is not a change ({e})"), false), changes };
            }
        }
    }
    Journal { changes, broken: None }
}

impl BrokenLine {
    /// The unreadable line as an error.
    pub fn error(&self, dir: &Path) -> SessionError {
        bad_line(dir, self.line, self.reason.clone())
    }
}

/// The error for a line that is inconsistent with those before it.
pub(in crate::session) fn bad_line(dir: &Path, line: usize, reason: String) -> SessionError {
    SessionError::BadFile {
        path: path_in(dir),
        line: Some(line),
        reason,
        hint: "the journal was edited or damaged; `overcoat fsck` moves what follows that line to another file and restores the state before it"
            .into(),
    }
}

pub(in crate::session) fn append(dir: &Path, change: &Change) -> Result<(), SessionError> {
    let line = serde_json::to_string(change).map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
    append_line(&path_in(dir), &line)
}
