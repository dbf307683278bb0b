//! Masks among the inputs of a stage, applied to the scan of their step.

use crate::formats::RawMesh;
use crate::scan::Scan;
use crate::segment::{Labels, Marks, PaintedBefore, SegmentError};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::memo::input::FileInput;
use crate::session::recipe::{MaskFile, SourceFile, StepRecipe};
use crate::session::store::{Kept, Store};
use serde::Serialize;
use std::path::Path;

/// A mask of a garment.
#[derive(Clone, Debug, Serialize)]
#[serde(transparent)]
pub(in crate::session) struct MaskInput {
    pub file: FileInput,
    /// The garment, whose name strokes must have; what they mark does not depend on it.
    #[serde(skip)]
    layer: String,
    /// The name that the garment had when the strokes were painted, if it was another.
    #[serde(skip)]
    layer_before: Option<String>,
}

impl MaskInput {
    pub fn of(session: &Session, layer: &str, source: &SourceFile) -> Self {
        let file = FileInput::of(session, source);
        Self { file, layer: layer.into(), layer_before: source.layer.clone() }
    }

    /// A mask that is not in the recipe yet.
    pub fn new(path: &Path, layer: &str, layer_before: Option<&str>) -> Self {
        let file = FileInput::at(path.to_path_buf(), None);
        Self { file, layer: layer.into(), layer_before: layer_before.map(String::from) }
    }

    pub fn read(&self, store: &Store) -> Result<MaskFile, SessionError> {
        MaskFile::read(self.file.path(), &self.file.bytes(store)?)
    }

    /// What the mask marks on a scan, the artefact `kept`; `of` is the scan's file.
    pub fn marks(
        &self,
        mask: &MaskFile,
        store: &Store,
        of: &FileInput,
        kept: Kept<Scan>,
        scan: &Scan,
    ) -> Result<Marks, SessionError> {
        let file_vertices = || Ok::<_, SessionError>(of.mesh(store)?.map(|raw| raw.points.len()));
        let marks = match mask {
            MaskFile::Strokes(strokes) => {
                mask.check_layer(&self.layer, self.layer_before.as_deref(), self.file.path())?;
                Marks::paint_again(scan, strokes, &store.prepared(kept.hash, PaintedBefore::default))
            }
            MaskFile::Surface(surface) => match surface.marks_on(scan, None) {
                // The message names the vertices of the scan's file, which is read only then.
                Err(SegmentError::OffTheScan { .. }) => surface.marks_on(scan, file_vertices()?),
                other => other,
            },
            MaskFile::Numbers(numbers) => {
                let vertices = if numbers.len() == scan.mesh.vertex_count() { None } else { file_vertices()? };
                Marks::from_numbers(numbers, scan, vertices)
            }
            MaskFile::Picture(picture) => {
                Marks::from_picture(picture, of.mesh(store)?.and_then(|raw| raw.uvs).as_deref(), scan)
            }
        };
        let marks = marks.map_err(|e| self.file.fault(e))?;
        // A painted file that was not painted yet marks nothing.
        let may_be_empty = matches!(mask, MaskFile::Surface(surface) if surface.is_painted());
        match may_be_empty || !marks.are_none() {
            true => Ok(marks),
            false => Err(self.file.fault(SegmentError::MarksNothing)),
        }
    }
}

/// The masks of all garments that a scan shows for the first time: a mask of one takes from the others.
#[derive(Clone, Debug, Serialize)]
pub(in crate::session) struct MasksOfScan {
    /// The scan's file, whose vertices and texture coordinates masks may refer to.
    file: FileInput,
    /// By garment, innermost first; in the order of their application.
    masks: Vec<Vec<MaskInput>>,
    /// Which of these garments is that of the step.
    pub place: usize,
}

impl MasksOfScan {
    pub fn of(session: &Session, step: &StepRecipe) -> Self {
        let outfit = session.recipe.outfit_of(step);
        let of_step = |of: &StepRecipe| of.masks.iter().map(|mask| MaskInput::of(session, &of.name, mask)).collect();
        Self {
            file: FileInput::of(session, &step.source()),
            masks: outfit.iter().map(of_step).collect(),
            place: outfit.iter().position(|of| of.name == step.name).unwrap_or_default(),
        }
    }

    /// Those of the step's garment.
    pub fn own(&self) -> &[MaskInput] {
        self.masks.get(self.place).map_or(&[], Vec::as_slice)
    }

    /// The marks of the step's garment by those of its masks whose number `counts`. Later masks override earlier ones.
    pub fn marks(
        &self,
        store: &Store,
        kept: Kept<Scan>,
        scan: &Scan,
        counts: impl Fn(usize) -> bool,
    ) -> Result<Marks, SessionError> {
        let own = self.own().iter().enumerate().filter(|(number, _)| counts(*number));
        self.united(store, kept, scan, own.map(|(_, mask)| mask))
    }

    /// The marks of each garment.
    pub fn marks_of_all(&self, store: &Store, kept: Kept<Scan>, scan: &Scan) -> Result<Vec<Marks>, SessionError> {
        self.masks.iter().map(|masks| self.united(store, kept, scan, masks.iter())).collect()
    }

    fn united<'a>(
        &self,
        store: &Store,
        kept: Kept<Scan>,
        scan: &Scan,
        masks: impl Iterator<Item = &'a MaskInput>,
    ) -> Result<Marks, SessionError> {
        let mut all = Marks::none(scan.mesh.vertex_count());
        for mask in masks {
            all = all.then(&mask.marks(&mask.read(store)?, store, &self.file, kept, scan)?);
        }
        Ok(all)
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
        FileInput::of(self, &self.recipe.step(step)?.source()).mesh(&self.store)
    }
}
