//! Sizes of a garment, each on the figure of the last step, which does not change.

use super::pictures::{draw_ease, girth_notes};
use crate::body::Figure;
use crate::check::SizeVerdict;
use crate::scan::Unit;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::{FileInput, recognized};
use crate::session::results::outputs::Outputs;
use crate::session::store::ContentHash;
use crate::tryon::{Ease, UprightGarment, Worn, at_rest, edge_length_p95};
use crate::view::EaseRow;
use std::path::{Path, PathBuf};

/// A file of one size: `M=trousers-M.obj`.
#[derive(Clone, Debug, PartialEq)]
pub struct SizedFile {
    /// The size's name.
    pub size: String,
    /// The garment.
    pub file: PathBuf,
}

impl std::str::FromStr for SizedFile {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once('=') {
            Some((size, file)) if !size.is_empty() && !file.is_empty() => {
                Ok(Self { size: size.into(), file: file.into() })
            }
            _ => Err("expected SIZE=FILE, as in M=trousers-M.obj".into()),
        }
    }
}

/// A size on the figure.
pub struct TriedSize {
    /// Its name and file.
    pub sized: SizedFile,
    /// Whether it fits.
    pub verdict: SizeVerdict,
    /// Air, stretch and girths.
    pub ease: Ease,
    /// The garment at rest on the figure in the bind pose.
    pub worn: Worn,
    /// What was found and assumed, one sentence each.
    pub notes: Vec<String>,
}

/// Sizes of one garment on one figure.
pub struct TriedSizes {
    /// The garment kind.
    pub kind: String,
    /// The fabric.
    pub fabric: String,
    /// In the order given.
    pub sizes: Vec<TriedSize>,
    figure: Figure,
}

impl Session {
    /// Puts each size of a garment on the figure of the last step. `kind` and `fabric` are what the garment says if `None`.
    ///
    /// **Errors** without a figure; for a size or a file given twice, garments of different kinds, a file without a garment.
    pub fn try_sizes(
        &self,
        sized: &[SizedFile],
        unit: Option<Unit>,
        (kind, fabric): (Option<&str>, Option<&str>),
        on_size: &mut dyn FnMut(&str),
    ) -> Result<TriedSizes, SessionError> {
        let figure = self.figure_of_last_step()?;
        let read = self.distinct(sized, unit)?;
        let found = read[0].0.kind;
        if let Some((k, other)) = read.iter().enumerate().find(|(_, garment)| garment.0.kind != found) {
            return Err(SessionError::BadRequest {
                what: format!(
                    "{} is {found} by its openings, and {} is {}",
                    sized[0].file.display(),
                    sized[k].file.display(),
                    other.0.kind
                ),
                hint: "give sizes of one garment".into(),
            });
        }
        let (kind, fabric) = self.kind_and_fabric(kind.unwrap_or(found), fabric)?;
        let mut sizes = Vec::new();
        for (sized, (garment, notes)) in sized.iter().zip(read) {
            on_size(&sized.size);
            let worn =
                at_rest(&garment.mesh, &figure, &fabric.name).map_err(|e| SessionError::bad_source(&sized.file, e))?;
            let ease = Ease::of(&worn.mesh, Some(&garment.mesh), &worn.weights, &figure);
            let (edges, slid) = (edge_length_p95(&garment.mesh, &worn.mesh), worn.slides.then_some(worn.fell));
            let verdict = SizeVerdict::of(&ease.girths, Some(edges), slid, fabric);
            sizes.push(TriedSize { sized: sized.clone(), verdict, ease, worn, notes });
        }
        Ok(TriedSizes { kind, fabric: fabric.name.clone(), sizes, figure })
    }

    /// The garments of the files, no size and no file twice.
    fn distinct(
        &self,
        sized: &[SizedFile],
        unit: Option<Unit>,
    ) -> Result<Vec<(UprightGarment, Vec<String>)>, SessionError> {
        let mut hashes: Vec<ContentHash> = Vec::new();
        let mut read = Vec::new();
        for (k, SizedFile { size, file }) in sized.iter().enumerate() {
            if sized[..k].iter().any(|other| other.size == *size) {
                return Err(SessionError::BadRequest {
                    what: format!("the size {size} is given twice"),
                    hint: "give each size a name of its own".into(),
                });
            }
            let bytes = std::fs::read(file).map_err(|e| SessionError::reading(file, e))?;
            let hash = ContentHash::of(&bytes);
            if let Some(same) = hashes.iter().position(|other| *other == hash) {
                return Err(SessionError::BadRequest {
                    what: format!("{size} and {} are the same garment: the files are equal", sized[same].size),
                    hint: "give each size a file of its own".into(),
                });
            }
            hashes.push(hash);
            let (garment, unused) = recognized(&FileInput::at(file.clone(), None), &self.store, unit)?;
            let notes = garment.notes.iter().cloned().chain(unused.into_iter().map(|warning| warning.to_string()));
            let notes = notes.collect();
            read.push((garment, notes));
        }
        Ok(read)
    }
}

impl TriedSizes {
    /// Draws all sizes, one per row.
    pub fn write_picture(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SessionError> {
        let mut rows = Vec::new();
        for TriedSize { sized, verdict, ease, worn, .. } in &self.sizes {
            let notes = std::iter::once(verdict.to_string()).chain(girth_notes(ease)).collect();
            let (title, body) = (sized.size.clone(), &self.figure.body().mesh);
            rows.push(EaseRow { title, notes, body, garment: &worn.mesh, gap: &ease.gap });
        }
        draw_ease(path, outputs, (&self.kind, &format!("{}: distance from the skin", self.fabric)), &rows)
    }
}
