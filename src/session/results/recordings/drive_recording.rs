//! Shows a figure that landmarks drive, in the Rerun viewer: the landmarks on the left, the figure on the right.

use super::animation_recording::log_layers;
use super::recording::Shown;
use super::show_in::ShowIn;
use crate::body::Figure;
use crate::drive::PlayedFrame;
use crate::geometry::{Point, TriMesh, Vec3};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::view::{BESIDE, Recording, landmark_lines};

/// A figure that is driven, in a viewer or a recording, along the timeline `frame`.
pub struct DriveView {
    shown: Shown,
    is_first: bool,
}

impl DriveView {
    /// Begins to show.
    ///
    /// **Errors** for a file that may not be written, and a viewer that does not answer.
    pub fn begin(session: &Session, to: &ShowIn, force: bool) -> Result<Self, SessionError> {
        let name = session.name();
        let shown = Shown::begin(to, session.outputs(force), |sink| Recording::of_animation(&name, sink))?;
        Ok(Self { shown, is_first: true })
    }

    /// Shows a frame; `meshes` are the layers in its pose.
    pub fn show(&mut self, number: usize, frame: &PlayedFrame, figure: &Figure, meshes: &[TriMesh]) {
        let is_first = std::mem::replace(&mut self.is_first, false);
        self.shown.note(|recording| {
            recording.set_frame(number);
            let beside = |p: &Point| p + Vec3::x() * BESIDE;
            let places: Vec<Point> = frame.places.iter().flatten().map(beside).collect();
            let lines: Vec<[Point; 2]> = landmark_lines(&frame.places).map(|line| line.map(|p| beside(&p))).collect();
            recording.log_landmarks(&places, &lines)?;
            log_layers(recording, figure, meshes, is_first)
        });
    }

    /// Ends; writes the file of a recording.
    pub fn finish(self) -> Result<(), SessionError> {
        self.shown.finish()
    }
}
