//! An open Rerun recording, whatever its target.

use super::show_in::ShowIn;
use crate::session::error::SessionError;
use crate::session::results::outputs::{Content, Outputs};
use crate::view::{Error, Recording, Sink};

/// A recording and its first error. The recorded work continues after an error.
pub(in crate::session) struct Shown {
    to: ShowIn,
    outputs: Outputs,
    recording: Recording,
    failed: Option<Error>,
}

impl Shown {
    /// Begins a recording; a path that cannot be written is refused before the work.
    pub fn begin(
        to: &ShowIn,
        mut outputs: Outputs,
        of: impl FnOnce(Sink) -> Result<Recording, Error>,
    ) -> Result<Self, SessionError> {
        if let ShowIn::File(path) = to {
            outputs.claim(path, Content::Recording)?;
        }
        let sink = match to {
            ShowIn::Viewer(bind) => Sink::NewViewer(*bind),
            ShowIn::ViewerAt(url) => Sink::ViewerAt(url),
            ShowIn::File(_) => Sink::Memory,
        };
        let recording = of(sink).map_err(|e| not_shown(to, e))?;
        let shown = Self { to: to.clone(), outputs, recording, failed: None };
        if matches!(to, ShowIn::ViewerAt(_)) {
            // Report a viewer that does not answer before the work, not after it.
            shown.recording.sent().map_err(|e| not_shown(to, e))?;
        }
        Ok(shown)
    }

    /// Records something unless an error occurred before.
    pub fn note(&mut self, log: impl FnOnce(&Recording) -> Result<(), Error>) {
        if self.failed.is_none() {
            self.failed = log(&self.recording).err();
        }
    }

    /// Writes the recording, or waits until the viewer has received it.
    pub fn finish(self) -> Result<(), SessionError> {
        let Self { to, mut outputs, recording, failed } = self;
        if let Some(e) = failed {
            return Err(not_shown(&to, e));
        }
        match &to {
            ShowIn::File(path) => outputs.write(path, Content::Recording, |out| recording.finish(out)),
            _ => recording.sent().map_err(|e| not_shown(&to, e)),
        }
    }
}

fn not_shown(to: &ShowIn, e: Error) -> SessionError {
    match to {
        ShowIn::File(path) => SessionError::bad_source(path, e),
        _ => SessionError::viewer(e),
    }
}
