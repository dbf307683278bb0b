//! The error of recordings in a program built without the viewer.

use super::show_in::ShowIn;
use crate::scan::FusionStep;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::Event;
use crate::session::results::outputs::Outputs;

/// The recording of a scan; it has no values.
pub(in crate::session) enum ScanRecording {}

impl ScanRecording {
    /// Always an error.
    pub fn try_new(_name: &str, _to: &ShowIn, _outputs: Outputs) -> Result<Self, SessionError> {
        Err(without_viewer())
    }

    /// Never called.
    pub fn see(&mut self, _step: &FusionStep) {
        match *self {}
    }

    /// Never called.
    pub fn finish(self, _findings: &[String]) -> Result<(), SessionError> {
        match self {}
    }
}

/// The recording of fits; it has no values.
pub(in crate::session) enum FitRecording {}

impl FitRecording {
    /// Always an error.
    pub fn try_new(_session: &str, _to: &ShowIn, _outputs: Outputs) -> Result<Self, SessionError> {
        Err(without_viewer())
    }

    /// Never called.
    pub fn see(&mut self, _event: &Event) {
        match *self {}
    }

    /// Never called.
    pub fn finish(self) -> Result<(), SessionError> {
        match self {}
    }
}

/// The recording of an animation; it has no values.
pub(in crate::session) enum AnimationRecording {}

impl AnimationRecording {
    /// Always an error.
    pub fn try_new(_session: &str, _to: &ShowIn, _outputs: Outputs) -> Result<Self, SessionError> {
        Err(without_viewer())
    }

    /// Never called.
    pub fn see(&mut self, _event: &Event) {
        match *self {}
    }

    /// Never called.
    pub fn show(self, _session: &Session, _animation: &str) -> Result<(), SessionError> {
        match self {}
    }
}

pub(in crate::session) fn without_viewer() -> SessionError {
    SessionError::BadRequest {
        what: "this program was built without the viewer, so it cannot show or record anything".into(),
        hint: "build it with `cargo build --release`, or draw a picture with `overcoat view --sheet sheet.png`".into(),
    }
}
