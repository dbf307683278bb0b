//! Records an animation for the Rerun viewer: all layers along the timeline `frame`.

use super::recording::Shown;
use super::show_in::ShowIn;
use crate::body::Figure;
use crate::geometry::TriMesh;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::{Event, MovedFrame};
use crate::session::results::outputs::Outputs;
use crate::view::{Error, Recording, painted};

/// Frames per second of a recording: a frame of a dressed figure takes half a megabyte.
const RECORDED_FPS: f64 = 15.0;

/// An open recording of an animation.
pub(in crate::session) struct AnimationRecording {
    shown: Shown,
    /// Frames that were shown.
    frames: usize,
}

impl AnimationRecording {
    /// Begins a recording.
    pub fn try_new(session: &str, to: &ShowIn, outputs: Outputs) -> Result<Self, SessionError> {
        let shown = Shown::begin(to, outputs, |sink| Recording::of_animation(session, sink))?;
        Ok(Self { shown, frames: 0 })
    }

    /// Shows cloth as it is computed.
    pub fn see(&mut self, event: &Event) {
        let Event::Moved { at: MovedFrame { figure, fps, frame, at } } = event else { return };
        if frame % interval(*fps) != 0 {
            return;
        }
        let mut rest = *at;
        let meshes = figure.layers.iter().map(|layer| {
            let (own, others) = rest.split_at(layer.mesh.vertex_count());
            rest = others;
            layer.mesh.with_points(own.to_vec())
        });
        let meshes: Vec<TriMesh> = meshes.collect();
        self.show_frame(figure, *frame, &meshes);
    }

    /// Records the frames of an animation that is up to date, unless they were seen, and ends the recording.
    pub fn show(mut self, session: &Session, animation: &str) -> Result<(), SessionError> {
        if self.frames == 0 {
            let moved = session.moved_figure(Some(animation))?;
            let figure = moved.trims.added_to(session.textured_figure()?);
            for frame in (0..moved.track.poses.len()).step_by(interval(moved.track.fps)) {
                self.show_frame(&figure, frame, &moved.surfaces(&figure, frame));
            }
        }
        self.shown.finish()
    }

    fn show_frame(&mut self, figure: &Figure, frame: usize, meshes: &[TriMesh]) {
        let is_first = self.frames == 0;
        self.frames += 1;
        self.shown.note(|recording| {
            recording.set_frame(frame);
            log_layers(recording, figure, meshes, is_first)
        });
    }
}

/// Frames from one that is shown to the next.
fn interval(fps: f64) -> usize {
    (fps / RECORDED_FPS).round().max(1.0) as usize
}

/// Shows the layers of a figure; after the first time, only their vertices move.
pub(super) fn log_layers(
    recording: &Recording,
    figure: &Figure,
    meshes: &[TriMesh],
    is_first: bool,
) -> Result<(), Error> {
    for (rank, (layer, mesh)) in figure.layers.iter().zip(meshes).enumerate() {
        match is_first {
            true => recording.log_garment(&layer.name, &painted(mesh, layer, rank)?)?,
            false => recording.log_garment_moved(&layer.name, mesh)?,
        }
    }
    Ok(())
}
