//! What is said where recordings are asked for and the program was built without the viewer.

use super::SessionError;
use crate::scan::FusionStep;
use std::path::Path;

/// Stands for the recording of a scan, and is never made.
pub(super) struct ScanRecording;

impl ScanRecording {
    /// Always an error.
    pub fn try_new(_name: &str, _path: &Path) -> Result<Self, SessionError> {
        Err(without_viewer())
    }

    pub fn see(&mut self, _step: &FusionStep) {}

    pub fn finish(self, _findings: &[String]) -> Result<(), SessionError> {
        Err(without_viewer())
    }
}

pub(super) fn without_viewer() -> SessionError {
    SessionError::BadRequest {
        what: "this program was built without the viewer, so it shows and records nothing".into(),
        hint: "build it with `cargo build --release`, or draw a picture with `overcoat view --sheet sheet.png`".into(),
    }
}
