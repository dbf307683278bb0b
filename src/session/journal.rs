//! One line a change: what was done, and the names of the recipe and the state that it led to.

use super::durable::append_line;
use super::{ContentHash, SessionError};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// One change of a session. Recipe and state are artefacts, so every earlier state can be had again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// What was done, as a person would say it.
    pub change: String,
    /// The text of `recipe.toml` afterwards.
    pub recipe: ContentHash,
    /// The text of `session.json` afterwards.
    pub state: ContentHash,
}

pub(super) fn path_in(dir: &Path) -> PathBuf {
    dir.join("journal.jsonl")
}

/// All changes, oldest first. A last line that was not finished never happened.
pub(super) fn read(dir: &Path) -> Result<Vec<Change>, SessionError> {
    let path = path_in(dir);
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(e) => return Err(SessionError::reading(&path, e)),
    };
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    whole
        .lines()
        .enumerate()
        .map(|(i, line)| {
            serde_json::from_str(line).map_err(|e| SessionError::BadFile {
                path: path.clone(),
                line: Some(i + 1),
                reason: format!("no change can be read there ({e})"),
                hint: "the journal was edited or damaged; take that line out, or delete journal.jsonl to forget the history".into(),
            })
        })
        .collect()
}

pub(super) fn append(dir: &Path, change: &Change) -> Result<(), SessionError> {
    let line = serde_json::to_string(change).map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
    append_line(&path_in(dir), &line)
}
