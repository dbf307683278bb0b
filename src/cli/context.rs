//! Where a command works, and the commands as a prompt runs them.

use super::console::{Console, Done};
use crate::session::{Session, SessionError, Writer};
use std::path::PathBuf;

/// Where a command works.
pub(super) struct Context {
    pub session: PathBuf,
    pub session_given: bool,
    pub console: Console,
}

impl Context {
    /// The session, to be looked at.
    pub fn reader(&self) -> Result<Session, SessionError> {
        let session = Session::open(&self.session)?;
        self.console.notices(session.notices());
        Ok(session)
    }

    /// The session, to be changed.
    pub fn writer(&self) -> Result<Writer, SessionError> {
        let writer = Writer::open(&self.session)?;
        self.console.notices(writer.session().notices());
        Ok(writer)
    }

    /// An input as seen from the current folder, or else from the session's.
    pub fn input(&self, path: PathBuf) -> PathBuf {
        let from_session = self.session.join(&path);
        if !path.exists() && from_session.exists() { from_session } else { path }
    }

    /// `overcoat` with the `-C` that a person would have to type again.
    pub fn overcoat(&self, rest: &str) -> String {
        match self.session_given {
            true => format!("overcoat -C {} {rest}", self.session.display()),
            false => format!("overcoat {rest}"),
        }
    }
}

/// The commands of the program, for a prompt that runs them as typed.
#[derive(Clone, Copy)]
pub(super) struct Commands {
    /// Their names.
    pub names: fn() -> Vec<String>,
    /// Runs one; help is what it says.
    pub run: fn(&[String], &Context) -> anyhow::Result<Done>,
}
