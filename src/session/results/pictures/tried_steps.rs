//! The steps of the paper's try-on, on the figure of the last step, which does not change.

use crate::body::{Figure, Pose};
use crate::formats::{PlyOptions, RawMesh, write_ply};
use crate::geometry::TriMesh;
use crate::motion::{MotionParams, built_in_clip, follow};
use crate::scan::Unit;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::{FileInput, read_clip, recognized};
use crate::session::results::outputs::{Content, Outputs};
use crate::tryon::{Steps, Switches, by_paper};
use crate::view::tryon_steps;
use std::path::{Path, PathBuf};

/// A frame of a clip: `walk:60`, or `dance.bvh:12`.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipFrame {
    /// One of our own clips, or a file.
    pub clip: String,
    /// Counted from 0.
    pub frame: usize,
}

impl std::str::FromStr for ClipFrame {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.rsplit_once(':').and_then(|(clip, frame)| Some((clip, frame.parse().ok()?)));
        let (clip, frame) = parts.ok_or("expected a clip and a frame, such as walk:60 or dance.bvh:12")?;
        Ok(Self { clip: clip.into(), frame })
    }
}

/// A garment after some of the steps.
pub struct TriedSteps {
    /// The result of each step.
    pub steps: Steps,
    /// What was found and assumed, one sentence each.
    pub notes: Vec<String>,
    garment: TriMesh,
    figure: Figure,
    pose: Pose,
}

impl Session {
    /// Takes the garment of a file through the steps of Shi 2020, without simulation, on the figure of the last step, in the bind
    /// pose or in a frame of a clip.
    ///
    /// **Errors** without a figure, for a file without a garment, and for a frame that the clip does not have.
    pub fn try_steps(
        &self,
        file: &Path,
        unit: Option<Unit>,
        frame: Option<&ClipFrame>,
        switches: Switches,
    ) -> Result<TriedSteps, SessionError> {
        let figure = self.figure_of_last_step()?;
        let pose = match frame {
            None => Pose::bind(figure.skeleton.len()),
            Some(frame) => self.pose_in(frame, &figure)?,
        };
        let input = FileInput::at(file.to_path_buf(), None);
        let (garment, unused) = recognized(&input, &self.store, unit)?;
        let steps = by_paper(&garment.mesh, &figure, &pose, switches).map_err(|e| SessionError::bad_source(file, e))?;
        let unused = unused.into_iter().map(|warning| warning.to_string());
        let notes = garment.notes.iter().chain(&steps.notes).cloned().chain(unused).collect();
        Ok(TriedSteps { steps, notes, garment: garment.mesh, figure, pose })
    }

    pub(in crate::session::results) fn pose_in(
        &self,
        ClipFrame { clip, frame }: &ClipFrame,
        figure: &Figure,
    ) -> Result<Pose, SessionError> {
        let clip = match built_in_clip(clip) {
            Some(clip) => clip,
            None => {
                let path = PathBuf::from(clip);
                // Without an extension it is a wrong name of one of ours, which is said when it is read.
                let bytes = match path.extension() {
                    Some(_) => std::fs::read(&path).map_err(|e| SessionError::reading(&path, e))?,
                    None => Vec::new(),
                };
                read_clip(&path, &bytes, None, Some(&figure.skeleton))?
            }
        };
        let (track, _) = follow(&clip, figure, None, None, &MotionParams::default())
            .map_err(|e| SessionError::bad_source(Path::new(&clip.name), e))?;
        let poses = track.clip_poses();
        poses.get(*frame).cloned().ok_or_else(|| SessionError::BadRequest {
            what: format!("the clip has {} frames, and none with the number {frame}", poses.len()),
            hint: format!("give a frame from 0 to {}", poses.len().saturating_sub(1)),
        })
    }
}

impl TriedSteps {
    /// Writes all steps as one picture.
    pub fn write_picture(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SessionError> {
        let Self { steps, garment, figure, pose, .. } = self;
        let picture = tryon_steps(steps, garment, figure, pose).map_err(|e| SessionError::bad_source(path, e))?;
        outputs.write(path, Content::Picture, |out| picture.write_png(out))
    }

    /// Writes the garment as the last step left it, in metres, where the figure is.
    pub fn write_mesh(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SessionError> {
        let mesh = self.steps.last_mesh().unwrap_or(&self.garment);
        let raw = RawMesh {
            points: mesh.points().iter().map(|p| [p.x, p.y, p.z]).collect(),
            faces: mesh.faces().iter().map(|face| face.map(|v| v.0)).collect(),
            ..RawMesh::default()
        };
        outputs.write(path, Content::Mesh, |out| write_ply(&raw, &PlyOptions::default(), out))
    }

    /// Vertices of the garment inside the body before and after the removal of interpenetration, if it was run.
    pub fn inside(&self) -> Option<[usize; 2]> {
        self.steps.cleared.as_ref().map(|cleared| cleared.inside)
    }
}
