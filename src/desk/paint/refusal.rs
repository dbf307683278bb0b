//! Why a request of the page is not done, in a sentence.

use crate::desk::error::DeskError;
use crate::session::SessionError;
use serde_json::{Value, json};
use std::io::ErrorKind;

/// What the page can do about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Send it again later: the session is being changed, or the disk is full.
    Later,
    /// It cannot be done as it is.
    Refused,
    /// The layer is gone, or its scan is another one.
    Moved,
    /// The sender may not ask for anything.
    Stranger,
}

/// A request that was not done; nothing has changed.
#[derive(Debug)]
pub(super) struct Refusal {
    pub status: u16,
    pub kind: Kind,
    /// One sentence.
    pub what: String,
    pub hint: Option<String>,
}

impl Refusal {
    pub fn new(status: u16, kind: Kind, what: impl Into<String>) -> Self {
        Self { status, kind, what: what.into(), hint: None }
    }

    pub fn to_json(&self) -> Value {
        let kind = match self.kind {
            Kind::Later => "later",
            Kind::Refused => "refused",
            Kind::Moved => "moved",
            Kind::Stranger => "stranger",
        };
        json!({ "error": self.what, "hint": self.hint, "kind": kind })
    }
}

impl From<SessionError> for Refusal {
    fn from(error: SessionError) -> Self {
        let (status, kind) = match &error {
            SessionError::Locked { .. } => (423, Kind::Later),
            SessionError::Writing { .. } => (507, Kind::Later),
            SessionError::UnknownStep { .. } => (410, Kind::Moved),
            _ => (422, Kind::Refused),
        };
        let what = match &error {
            SessionError::Writing { source, .. } if source.kind() == ErrorKind::StorageFull => {
                "the disk is full, so nothing was changed".into()
            }
            error => error.to_string(),
        };
        Self { status, kind, hint: error.hint(), what }
    }
}

impl From<DeskError> for Refusal {
    fn from(error: DeskError) -> Self {
        match error {
            DeskError::Session(error) => error.into(),
            other => Self::new(500, Kind::Refused, other.to_string()),
        }
    }
}
