//! Labels given by hand: brush strokes or a label a vertex, from files.

use super::open::{Session, Writer};
use super::recipe::{SourceFile, StepRecipe};
use super::stage_error::StageError;
use super::walk::Walk;
use super::{SessionError, source, stage_scan};
use crate::formats::{read_npy, read_ply};
use crate::geometry::PerVertex;
use crate::scan::Scan;
use crate::segment::{Labels, Marks, Stroke};
use std::path::Path;

/// What a mask does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MaskReport {
    /// Vertices of the scan that it makes the garment.
    pub added: usize,
    /// Vertices of the scan that it takes from the garment.
    pub erased: usize,
}

/// What a mask file holds.
enum Mask {
    Strokes(Vec<Stroke>),
    /// One number a vertex.
    Labels(Vec<f64>),
}

impl Writer {
    /// Adds a mask to a garment. The session is as it was if anything is wrong with it.
    pub fn add_mask(&mut self, layer: &str, file: &Path) -> Result<MaskReport, SessionError> {
        let step = self.session.recipe.step(layer)?.clone();
        if step.template.is_none() {
            return Err(SessionError::MaskOnBody);
        }
        let bytes = source::read(file)?;
        let mask = read(file, &bytes)?;
        let scan = stage_scan::scan(&mut Walk::look(&self.session), &step)?;
        let scan = self.session.store.load(scan)?;
        let marks = paint(&self.session, &step, &scan, file, &mask)?;
        let named = source::named(self.session.dir(), file, &bytes)?;
        self.session.store.keep_bytes(&bytes)?;
        self.session.recipe.step_mut(layer)?.masks.push(named);
        self.save(&format!("mask {layer}"))?;
        let count = |label: bool| marks.0.iter().filter(|m| **m == Some(label)).count();
        Ok(MaskReport { added: count(true), erased: count(false) })
    }
}

/// All masks of a step on its scan; of two on the same place the later counts.
pub(super) fn marks_of(session: &Session, step: &StepRecipe, scan: &Scan) -> Result<Marks, SessionError> {
    let mut all = Marks::none(scan.mesh.vertex_count());
    for source in &step.masks {
        let path = session.resolve(&source.file);
        let mask = read(&path, &session.source_bytes(source)?)?;
        let marks = paint(session, step, scan, &path, &mask)?;
        for (slot, mark) in all.0.0.iter_mut().zip(marks.0.iter()) {
            *slot = mark.or(*slot);
        }
    }
    Ok(all)
}

fn read(path: &Path, bytes: &[u8]) -> Result<Mask, SessionError> {
    let bad = |e: StageError| SessionError::BadSource { path: path.to_path_buf(), source: Box::new(e) };
    match path.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
        Some("npy") => {
            let array = read_npy(bytes).map_err(|e| bad(e.into()))?;
            Ok(Mask::Labels(array.to_f64("labels").map_err(|e| bad(e.into()))?))
        }
        Some("ply") => {
            let raw = read_ply(bytes).map_err(|e| bad(e.into()))?;
            match raw.scalars.get("label").or_else(|| raw.scalars.get("quality")) {
                Some(values) => Ok(Mask::Labels(values.iter().map(|&v| f64::from(v)).collect())),
                None => Err(SessionError::BadRequest {
                    what: format!("'{}' has no property 'label' or 'quality' on its vertices", path.display()),
                    hint: "label the file that `overcoat export DIR/ --at STEP` writes to DIR/labels".into(),
                }),
            }
        }
        Some("jsonl" | "json") | None => {
            let text = std::str::from_utf8(bytes).map_err(|_| SessionError::BadRequest {
                what: format!("'{}' is not text, so it holds no brush strokes", path.display()),
                hint: MASK_KINDS.into(),
            })?;
            let strokes = Stroke::read_lines(text).map_err(|e| bad(e.into()))?;
            if strokes.is_empty() {
                return Err(SessionError::BadRequest {
                    what: format!("'{}' holds no brush stroke", path.display()),
                    hint: MASK_KINDS.into(),
                });
            }
            Ok(Mask::Strokes(strokes))
        }
        Some(other) => Err(SessionError::BadRequest {
            what: format!("'{}' is no mask: the extension '{other}' is not known", path.display()),
            hint: MASK_KINDS.into(),
        }),
    }
}

const MASK_KINDS: &str = "a mask is a .jsonl file with one brush stroke a line, or one label a vertex as .npy or .ply";

fn paint(session: &Session, step: &StepRecipe, scan: &Scan, path: &Path, mask: &Mask) -> Result<Marks, SessionError> {
    match mask {
        Mask::Strokes(strokes) => {
            if let Some(other) = strokes.iter().find(|s| s.layer != step.name) {
                return Err(SessionError::BadFile {
                    path: path.to_path_buf(),
                    line: Some(other.line),
                    reason: format!("the stroke is for the layer '{}', not for '{}'", other.layer, step.name),
                    hint: format!("name that layer in the command, or write \"layer\":\"{}\"", step.name),
                });
            }
            Marks::paint(scan, strokes).map_err(|e| SessionError::bad_source(path, e))
        }
        Mask::Labels(numbers) => {
            let file_vertices = vertices_of_file(session, &step.source());
            let labels =
                Labels::from_numbers(numbers, scan, file_vertices).map_err(|e| SessionError::bad_source(path, e))?;
            Ok(Marks(labels.0.iter().map(|&label| Some(label)).collect::<PerVertex<_>>()))
        }
    }
}

/// How many vertices the scan's file has, if it can still be told.
fn vertices_of_file(session: &Session, source: &SourceFile) -> Option<usize> {
    let bytes = session.source_bytes(source).ok()?;
    stage_scan::raw_mesh(&session.resolve(&source.file), &bytes).ok().map(|raw| raw.points.len())
}
