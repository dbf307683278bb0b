//! Applies masks to the scan of their step.

use crate::formats::RawMesh;
use crate::scan::Scan;
use crate::segment::{Labels, Marks, SegmentError};
use crate::session::error::SessionError;
use crate::session::open::{ScanInput, Session};
use crate::session::recipe::{MaskFile, SourceFile, StepRecipe};
use std::path::Path;

/// Applies all masks of a step to its scan. Later masks override earlier ones.
pub(in crate::session) fn marks_of(session: &Session, step: &StepRecipe, scan: &Scan) -> Result<Marks, SessionError> {
    marks_of_some(session, step, scan, |_| true)
}

pub(in crate::session) fn marks_of_some(
    session: &Session,
    step: &StepRecipe,
    scan: &Scan,
    of: impl Fn(usize) -> bool,
) -> Result<Marks, SessionError> {
    let mut all = Marks::none(scan.mesh.vertex_count());
    for (_, source) in step.masks.iter().enumerate().filter(|&(i, _)| of(i)) {
        all = all.then(&session.read_mask(step, source, scan)?.1);
    }
    Ok(all)
}

pub(in crate::session) fn nothing_left(file: &Path, line: Option<usize>, layer: &str) -> SessionError {
    SessionError::BadFile {
        path: file.to_path_buf(),
        line,
        reason: format!("after this mask nothing of the garment '{layer}' is left"),
        hint: "erase less of it".into(),
    }
}

/// Whether the labels include at least one whole face.
pub(in crate::session) fn is_something(scan: &Scan, labels: &Labels) -> bool {
    scan.mesh.faces().iter().any(|face| face.iter().all(|&v| labels.0[v]))
}

impl Session {
    /// The mesh of a step's scan as its file has it, in full detail, with texture coordinates, materials and pictures;
    /// `None` for a recording of frames. It is read from the session's copy of the file.
    ///
    /// **Frame and units** the file's: the cleaned scan's `world_from_file` maps it to the world.
    pub fn full_scan(&self, step: &str) -> Result<Option<RawMesh>, SessionError> {
        self.file_mesh(self.recipe.step(step)?)
    }

    /// The mesh in the file of a step's scan; `None` for a recording of frames.
    pub(in crate::session) fn file_mesh(&self, step: &StepRecipe) -> Result<Option<RawMesh>, SessionError> {
        let source = step.source();
        match self.input(&source)?.scan(&self.resolve(&source.file))? {
            ScanInput::Mesh(raw) => Ok(Some(*raw)),
            ScanInput::Frames(_) => Ok(None),
        }
    }

    fn file_vertices(&self, step: &StepRecipe) -> Result<Option<usize>, SessionError> {
        Ok(self.file_mesh(step)?.map(|raw| raw.points.len()))
    }

    pub(in crate::session) fn read_mask(
        &self,
        step: &StepRecipe,
        source: &SourceFile,
        scan: &Scan,
    ) -> Result<(MaskFile, Marks), SessionError> {
        let path = self.resolve(&source.file);
        let mask = MaskFile::read(&path, &self.source_bytes(source)?)?;
        let marks = mask.marks(self, step, source.layer.as_deref(), scan, &path)?;
        Ok((mask, marks))
    }
}

impl MaskFile {
    /// The marks on the step's scan; `path` is for messages.
    pub(in crate::session) fn marks(
        &self,
        session: &Session,
        step: &StepRecipe,
        layer_before: Option<&str>,
        scan: &Scan,
        path: &Path,
    ) -> Result<Marks, SessionError> {
        let vertices = scan.mesh.vertex_count();
        let marks = match self {
            Self::Strokes(strokes) => {
                self.check_layer(&step.name, layer_before, path)?;
                Marks::paint(scan, strokes)
            }
            Self::Surface(surface) => match surface.marks_on(scan, None) {
                // The message names the vertices of the scan's file, which is read only then.
                Err(SegmentError::OffTheScan { .. }) => surface.marks_on(scan, session.file_vertices(step)?),
                other => other,
            },
            Self::Numbers(numbers) => {
                let file_vertices = if numbers.len() == vertices { None } else { session.file_vertices(step)? };
                Marks::from_numbers(numbers, scan, file_vertices)
            }
            Self::Picture(picture) => {
                let uvs = session.file_mesh(step)?.and_then(|raw| raw.uvs);
                Marks::from_picture(picture, uvs.as_deref(), scan)
            }
        };
        let marks = marks.map_err(|e| SessionError::bad_source(path, e))?;
        // A painted file that was not painted yet marks nothing.
        let may_be_empty = matches!(self, Self::Surface(surface) if surface.is_painted());
        match may_be_empty || marks.labels.iter().any(Option::is_some) {
            true => Ok(marks),
            false => Err(SessionError::bad_source(path, SegmentError::MarksNothing)),
        }
    }
}
