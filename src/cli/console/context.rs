//! The context of a command, and the commands as run from a prompt.

use super::output::{Console, Done};
use crate::session::{Session, SessionError, Writer};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How long a command waits for another one that changes the session: longer than any stage for which `paint` holds it, as the
/// stacking of a coat (3 s).
const PATIENCE: Duration = Duration::from_secs(8);

/// The context of a command: folder and console.
pub(in crate::cli) struct Context {
    pub session: PathBuf,
    pub session_given: bool,
    pub console: Console,
}

impl Context {
    /// Opens the session for reading.
    pub fn reader(&self) -> Result<Session, SessionError> {
        let session = Session::open(&self.session)?;
        self.console.notices(session.notices());
        Ok(session)
    }

    /// Opens the session for reading, if the current folder has one; a folder given with `-C` must have one.
    pub fn reader_if_any(&self) -> Result<Option<Session>, SessionError> {
        match self.reader() {
            Err(SessionError::NotASession { .. }) if !self.session_given => Ok(None),
            session => session.map(Some),
        }
    }

    /// Opens the session for changes; waits a few seconds for another command that changes it.
    pub fn writer(&self) -> Result<Writer, SessionError> {
        let tell = |holder: &str| {
            let holder = if holder.is_empty() { "another process" } else { holder };
            self.console.notices(&[format!(
                "waiting up to {} s for {holder}, which is changing the session",
                PATIENCE.as_secs()
            )]);
        };
        let writer = Writer::open_within(&self.session, PATIENCE, tell)?;
        self.console.notices(writer.session().notices());
        Ok(writer)
    }

    /// Resolves an input path from the current folder, or else from the session's folder.
    pub fn input(&self, path: PathBuf) -> PathBuf {
        let from_session = self.session.join(&path);
        if !path.exists() && from_session.exists() { from_session } else { path }
    }

    /// `overcoat`, with `-C` if the user must repeat it.
    pub fn overcoat(&self, rest: &str) -> String {
        match self.session_given {
            true => format!("overcoat -C {} {rest}", quoted(&self.session)),
            false => format!("overcoat {rest}"),
        }
    }
}

/// A path as a shell reads it: quoted where it has spaces or other special characters.
pub(in crate::cli) fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    // Only a NUL cannot be quoted, and no path contains one.
    shlex::try_quote(&text).map(|quoted| quoted.into_owned()).unwrap_or(text)
}

/// The commands of the program, for a prompt.
#[derive(Clone, Copy)]
pub(in crate::cli) struct Commands {
    /// Their names.
    pub names: fn() -> Vec<String>,
    /// Runs a command. For `help` the output is the help text.
    pub run: fn(&[String], &Context) -> anyhow::Result<Done>,
}
