//! Exports the frames of an animation: a mesh per frame and layer, or a point cache per layer.

use super::animations::MovedFigure;
use crate::body::{Figure, Layer};
use crate::export::write_layer_ply;
use crate::formats::write_pc2;
use crate::geometry::TriMesh;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::results::outputs::NewFolder;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

/// How the frames are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SequenceKind {
    /// `<frame>/<layer>.ply`.
    Ply,
    /// `<layer>.ply` in the bind pose, and its vertices over time as `<layer>.pc2`.
    Pc2,
}

/// The request for the frames of an animation.
#[derive(Clone, Debug)]
pub struct SequenceRequest {
    /// The folder.
    pub target: PathBuf,
    /// How they are written.
    pub kind: SequenceKind,
    /// The animation; `None` for the last one.
    pub animation: Option<String>,
}

impl Session {
    /// Writes the frames of an animation, from the bind pose on, in our frame: metres, Y up. Returns the files.
    ///
    /// **Errors** for a folder that is not empty, as leftovers of another sequence would be taken for frames.
    pub fn export_sequence(
        &self,
        request: &SequenceRequest,
        on_frame: &mut dyn FnMut(usize, usize),
    ) -> Result<Vec<PathBuf>, SessionError> {
        let moved = self.moved_figure(request.animation.as_deref())?;
        let figure = moved.trims.added_to(self.figure_of_last_step()?);
        match request.kind {
            SequenceKind::Ply => ply_sequence(&request.target, &figure, &moved, on_frame),
            SequenceKind::Pc2 => point_caches(&request.target, &figure, &moved, on_frame),
        }
    }
}

fn ply_sequence(
    target: &Path,
    figure: &Figure,
    moved: &MovedFigure,
    on_frame: &mut dyn FnMut(usize, usize),
) -> Result<Vec<PathBuf>, SessionError> {
    let folder = NewFolder::create(target)?;
    let (poses, mut files) = (&moved.track.poses, Vec::new());
    let digits = poses.len().to_string().len().max(4);
    for frame in 0..poses.len() {
        let name = PathBuf::from(format!("{frame:0digits$}"));
        folder.make_folder(&name)?;
        for (layer, mesh) in figure.layers.iter().zip(moved.surfaces(figure, frame)) {
            let path = name.join(format!("{}.ply", layer.name));
            folder.write(&path, &ply_of(layer, &mesh, &target.join(&path))?)?;
            files.push(target.join(path));
        }
        on_frame(frame + 1, poses.len());
    }
    Ok(files)
}

/// The bytes of a layer's file at `path`, with the layer's surface as `mesh`.
fn ply_of(layer: &Layer, mesh: &TriMesh, path: &Path) -> Result<Vec<u8>, SessionError> {
    let mut bytes = Vec::new();
    write_layer_ply(mesh, layer.colors.as_ref(), &[], &mut bytes).map_err(|e| SessionError::bad_source(path, e))?;
    Ok(bytes)
}

fn point_caches(
    target: &Path,
    figure: &Figure,
    moved: &MovedFigure,
    on_frame: &mut dyn FnMut(usize, usize),
) -> Result<Vec<PathBuf>, SessionError> {
    let folder = NewFolder::create(target)?;
    let (poses, mut files) = (&moved.track.poses, Vec::new());
    let all = poses.len() * figure.layers.len();
    for (rank, layer) in figure.layers.iter().enumerate() {
        let (bind, cache) =
            (PathBuf::from(format!("{}.ply", layer.name)), PathBuf::from(format!("{}.pc2", layer.name)));
        folder.write(&bind, &ply_of(layer, &layer.mesh, &target.join(&bind))?)?;
        let rows = |frame: usize| {
            on_frame(rank * poses.len() + frame + 1, all);
            moved.layer(figure, rank, frame).iter().map(|p| p.coords.map(|c| c as f32).into()).collect()
        };
        // A layer's vertices over an hour are gigabytes: frame by frame.
        folder.write_with(&cache, |file| {
            write_pc2([poses.len(), layer.mesh.points().len()], 0.0, rows, BufWriter::new(file))
                .map_err(|e| SessionError::bad_source(&target.join(&cache), e))
        })?;
        files.extend([target.join(bind), target.join(cache)]);
    }
    Ok(files)
}
