//! Replaces `live_view` in a program built without the viewer.

use super::no_recording::without_viewer;
use super::show_in::ShowIn;
use crate::body::Figure;
use crate::cut::Garment;
use crate::drive::PlayedFrame;
use crate::geometry::TriMesh;
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

/// The view of a figure that is driven; it has no values.
pub enum DriveView {}

impl DriveView {
    /// Always an error.
    pub fn begin(_session: &Session, _to: &ShowIn, _force: bool) -> Result<Self, SessionError> {
        Err(without_viewer())
    }

    /// Never called.
    pub fn show(&mut self, _number: usize, _frame: &PlayedFrame, _figure: &Figure, _meshes: &[TriMesh]) {
        match *self {}
    }

    /// Never called.
    pub fn finish(self) -> Result<(), SessionError> {
        match self {}
    }
}
