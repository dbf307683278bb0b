//! Records an animation for the Rerun viewer: all layers along the timeline `frame`.

use super::recording::Shown;
use super::show_in::ShowIn;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::results::outputs::Outputs;
use crate::view::{Paint, Part, Recording, layer_color};

/// Frames per second of a recording: a frame of a dressed figure takes half a megabyte.
const RECORDED_FPS: f64 = 15.0;

/// An open recording of an animation.
pub(in crate::session) struct AnimationRecording {
    shown: Shown,
}

impl AnimationRecording {
    /// Begins a recording.
    pub fn try_new(session: &str, to: &ShowIn, outputs: Outputs) -> Result<Self, SessionError> {
        let shown = Shown::begin(to, outputs, |sink| Recording::of_animation(session, sink))?;
        Ok(Self { shown })
    }

    /// Records the frames of an animation that is up to date, and ends the recording.
    pub fn show(mut self, session: &Session, animation: &str) -> Result<(), SessionError> {
        let moved = session.moved_figure(Some(animation))?;
        let figure = session.figure_of_last_step()?;
        let step = (moved.track.fps / RECORDED_FPS).round().max(1.0) as usize;
        for frame in (0..moved.track.poses.len()).step_by(step) {
            let meshes = moved.surfaces(&figure, frame);
            self.shown.note(|recording| {
                recording.set_frame(frame);
                for (rank, (layer, mesh)) in figure.layers.iter().zip(&meshes).enumerate() {
                    match (frame, &layer.colors) {
                        (0, Some(colors)) => {
                            recording.log_garment(&layer.name, &Part::try_new(mesh, Paint::PerVertex(colors))?)?;
                        }
                        (0, None) => recording.log_garment(&layer.name, &Part::solid(mesh, layer_color(rank)))?,
                        _ => recording.log_garment_moved(&layer.name, mesh)?,
                    }
                }
                Ok(())
            });
        }
        self.shown.finish()
    }
}
