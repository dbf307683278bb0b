//! A clip that is written as its poses come.

use crate::body::{Figure, Pose};
use crate::formats::{FormatError, PoseLineWriter};
use crate::geometry::Point;
use crate::session::{Content, Outputs, SessionError, StreamedOutput};
use std::path::{Path, PathBuf};

/// The clip that is written as it arrives.
pub(super) struct Save {
    path: PathBuf,
    writer: PoseLineWriter<StreamedOutput>,
    root_in_bind: Point,
}

impl Save {
    pub fn begin(path: &Path, outputs: &mut Outputs, figure: &Figure) -> Result<Self, SessionError> {
        let output = outputs.stream(path, Content::Poses)?;
        let skeleton = &figure.skeleton;
        let parents: Vec<Option<usize>> = skeleton.parents.iter().map(|p| p.map(|p| p.index())).collect();
        let joints: Vec<[f64; 3]> = skeleton.joints_in_bind.iter().map(|p| [p.x, p.y, p.z]).collect();
        let writer = PoseLineWriter::begin(output, &skeleton.names, &parents, &joints).map_err(|e| written(path, e))?;
        Ok(Self { path: path.to_path_buf(), writer, root_in_bind: skeleton.joints_in_bind[0] })
    }

    pub fn frame(&mut self, at_secs: f64, pose: &Pose) -> Result<(), SessionError> {
        let root = self.root_in_bind + pose.translation;
        let rotations: Vec<[f64; 4]> = pose.rotations.iter().map(|q| [q.i, q.j, q.k, q.w]).collect();
        self.writer.frame(at_secs, [root.x, root.y, root.z], &rotations).map_err(|e| written(&self.path, e))
    }

    pub fn end(self, outputs: &mut Outputs) -> Result<(), SessionError> {
        outputs.end_stream(self.writer.into_inner())
    }
}

fn written(path: &Path, error: FormatError) -> SessionError {
    match error {
        FormatError::Io { source, .. } => SessionError::writing(path, source),
        other => SessionError::Internal { what: other.to_string() },
    }
}
