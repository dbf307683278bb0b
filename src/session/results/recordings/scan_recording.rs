//! Records the fusion of frames for the Rerun viewer: the camera's path around the person, the residual of each frame,
//! and the growing surface.

use super::recording::Shown;
use super::show_in::ShowIn;
use crate::formats::RawMesh;
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::scan::FusionStep;
use crate::session::error::SessionError;
use crate::session::results::outputs::Outputs;
use crate::view::{Error, Paint, Part, Recording, layer_color};
use nalgebra::Isometry3;

/// Number of recorded states of the growing surface; each takes a few megabytes.
const SURFACES: usize = 12;

/// An open recording of a fusion.
pub(in crate::session) struct ScanRecording {
    shown: Shown,
    cameras: Vec<Isometry3<f64>>,
}

impl ScanRecording {
    /// Begins a recording.
    pub fn try_new(name: &str, to: &ShowIn, outputs: Outputs) -> Result<Self, SessionError> {
        Ok(Self { shown: Shown::begin(to, outputs, |sink| Recording::of_fusion(name, sink))?, cameras: Vec::new() })
    }

    /// Records a step of the fusion.
    pub fn see(&mut self, step: &FusionStep) {
        let cameras = &mut self.cameras;
        self.shown.note(|recording| match step {
            FusionStep::Tracked { frame, of, pose, residual, so_far } => {
                recording.set_frame(*frame);
                if let Some(residual) = residual {
                    cameras.push(*pose);
                    recording.log_measure("residual_mm", 1e3 * residual)?;
                }
                recording.log_cameras(cameras)?;
                match frame % of.div_ceil(SURFACES).max(1) {
                    0 => log_surface(recording, &so_far.mesh()),
                    _ => Ok(()),
                }
            }
            FusionStep::Settled { most, .. } => recording.log_notes(&format!("frames moved by {:.2} mm", 1e3 * most)),
            FusionStep::Placed { poses } => {
                cameras.clone_from(poses);
                recording.log_cameras(poses)
            }
            FusionStep::Integrated { so_far } => log_surface(recording, &so_far.mesh()),
            _ => Ok(()),
        });
    }

    /// Ends the recording with the findings about the scan.
    pub fn finish(mut self, findings: &[String]) -> Result<(), SessionError> {
        let notes: String = findings.iter().map(|f| format!("- {f}\n")).collect();
        self.shown.note(|recording| recording.log_notes(&notes));
        self.shown.finish()
    }
}

fn log_surface(recording: &Recording, raw: &RawMesh) -> Result<(), Error> {
    let points = raw.points.iter().map(|&p| Point::from(p)).collect();
    // Before the first frames are integrated there may be no surface.
    let Ok(mesh) = TriMesh::try_from_indices(points, &raw.faces) else { return Ok(()) };
    match &raw.colors {
        None => recording.log_scan(&Part::solid(&mesh, layer_color(0))),
        Some(colors) => {
            let colors: PerVertex<[u8; 3]> = colors.iter().copied().collect();
            recording.log_scan(&Part::try_new(&mesh, Paint::PerVertex(&colors))?)
        }
    }
}
