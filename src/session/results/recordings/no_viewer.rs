//! Replaces `live_view` in a program built without the viewer.

use super::no_recording::without_viewer;
use super::show_in::ShowIn;
use crate::cut::Garment;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::results::outputs::Outputs;
use std::path::Path;

impl Session {
    /// Always an error: this program was built without the viewer.
    pub fn write_recording(&self, _path: &Path, _outputs: &mut Outputs) -> Result<(), SessionError> {
        Err(without_viewer())
    }
}

/// The live view of a session; it has no values.
pub enum LiveView {}

impl LiveView {
    /// **Errors** always.
    pub fn open(_session: &Session, _shown: &ShowIn) -> Result<Self, SessionError> {
        Err(without_viewer())
    }

    /// Never called.
    pub fn show_all(&mut self, _session: &Session) -> Result<(), SessionError> {
        match *self {}
    }

    /// Never called.
    pub fn show_cut(&mut self, _layer: &str, _garment: &Garment) -> Result<(), SessionError> {
        match *self {}
    }
}
