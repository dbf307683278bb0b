//! How frames become a scan, as a Rerun recording: the camera's path around the person, how far each frame lay from the
//! surface, and the surface as it grows.

use super::SessionError;
use crate::formats::RawMesh;
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::scan::FusionStep;
use crate::view::{Error, Paint, Part, Recording, layer_color};
use nalgebra::Isometry3;
use std::path::{Path, PathBuf};

/// The growing surface is recorded so often over all frames: each is a few megabytes.
const SURFACES: usize = 12;

/// A recording under way.
pub(super) struct ScanRecording {
    path: PathBuf,
    recording: Recording,
    cameras: Vec<Isometry3<f64>>,
    /// The first thing that went wrong; the scan goes on.
    failed: Option<Error>,
}

impl ScanRecording {
    /// Begins a recording that will be written to `path`.
    pub fn try_new(name: &str, path: &Path) -> Result<Self, SessionError> {
        let recording = Recording::of_fusion(name).map_err(|e| SessionError::bad_source(path, e))?;
        Ok(Self { path: path.to_path_buf(), recording, cameras: Vec::new(), failed: None })
    }

    /// Notes a step of the fusion.
    pub fn see(&mut self, step: &FusionStep) {
        if self.failed.is_none() {
            self.failed = self.note(step).err();
        }
    }

    fn note(&mut self, step: &FusionStep) -> Result<(), Error> {
        match step {
            FusionStep::Tracked { frame, of, pose, residual, so_far } => {
                self.recording.set_frame(*frame);
                if let Some(residual) = residual {
                    self.cameras.push(*pose);
                    self.recording.log_measure("residual_mm", 1e3 * residual)?;
                }
                self.recording.log_cameras(&self.cameras)?;
                if frame % of.div_ceil(SURFACES).max(1) == 0 {
                    self.log_surface(&so_far.mesh())?;
                }
            }
            FusionStep::Settled { most, .. } => {
                self.recording.log_notes(&format!("frames moved by {:.2} mm", 1e3 * most))?
            }
            FusionStep::Placed { poses } => {
                self.cameras.clone_from(poses);
                self.recording.log_cameras(poses)?;
            }
            FusionStep::Integrated { so_far } => self.log_surface(&so_far.mesh())?,
            _ => {}
        }
        Ok(())
    }

    fn log_surface(&self, raw: &RawMesh) -> Result<(), Error> {
        let points = raw.points.iter().map(|&p| Point::from(p)).collect();
        // Before the first frames are in, there may be none.
        let Ok(mesh) = TriMesh::try_from_indices(points, &raw.faces) else { return Ok(()) };
        match &raw.colors {
            None => self.recording.log_scan(&Part::solid(&mesh, layer_color(0))),
            Some(colors) => {
                let colors: PerVertex<[u8; 3]> = colors.iter().copied().collect();
                self.recording.log_scan(&Part::try_new(&mesh, Paint::PerVertex(&colors))?)
            }
        }
    }

    /// Writes it, with what there is to say of the scan.
    pub fn finish(self, findings: &[String]) -> Result<(), SessionError> {
        let failed = |e| SessionError::bad_source(&self.path, e);
        if let Some(e) = self.failed {
            return Err(failed(e));
        }
        let notes: String = findings.iter().map(|f| format!("- {f}\n")).collect();
        self.recording.log_notes(&notes).map_err(failed)?;
        let recording = self.recording;
        super::export::write(&self.path, |out| recording.finish(out))
    }
}
