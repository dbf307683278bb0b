//! Masks, that is labels given by hand: add, list, remove, and export for painting.

use crate::formats::{NpyArray, PlyOptions, write_npy, write_ply};
use crate::geometry::{Adjacency, PerVertex};
use crate::scan::Scan;
use crate::segment::{LabelledSurface, Labels, Marks};
use crate::session::error::SessionError;
use crate::session::open::{Session, Writer, source};
use crate::session::pipeline::{self, FileInput, Labelling, MaskInput, MasksOfScan, Walk, is_something, scan_of};
use crate::session::recipe::{MaskFile, SourceFile, StepRecipe, relative_to};
use crate::session::results::{Content, Outputs};
use crate::session::stage::Stage;
use crate::session::store::{ContentHash, Kept, StageRecord, write_whole};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The effect of a mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct MaskReport {
    /// Vertices of the scan that it marks as the garment.
    pub added: usize,
    /// Vertices of the scan that it marks as not the garment.
    pub erased: usize,
    /// Whether it replaced an earlier mask of the same file.
    pub replaced: bool,
    /// Whether it pins the labels of the whole scan: of numbers or a picture without unlabelled vertices, or of a painted
    /// file, because the garment was never built and the file does not contain the labels before painting.
    pub pins_all: bool,
}

/// A mask of a garment.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct MaskInfo {
    /// The garment.
    pub layer: String,
    /// Number from 1, in the order of application.
    pub number: usize,
    /// The file that the user edits, as written in the recipe.
    pub file: String,
    /// The kind of its content.
    pub kind: String,
    /// Vertices of the scan that it marks as the garment.
    pub added: usize,
    /// Vertices of the scan that it marks as not the garment.
    pub erased: usize,
}

/// The folder of masks that were anchored in space by the session.
const ANCHORED: &str = "masks";

fn count(marks: &Marks, label: bool) -> usize {
    marks.labels.iter().filter(|m| **m == Some(label)).count()
}

impl SourceFile {
    /// The file that the user edits.
    pub(in crate::session) fn edited(&self) -> &str {
        self.from.as_ref().unwrap_or(&self.file)
    }
}

/// What of a mask is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum MaskContent {
    /// The file, whose marks are anchored in space.
    File,
    /// Its marks, which the session anchors in space.
    Marks,
    /// The marks that differ from the labels before painting.
    Painted,
    /// The file: all labels of a painted surface that cannot be compared with those before.
    Everything,
}

/// A mask that was read and applied to its scan, but is not recorded yet.
pub(in crate::session) struct NewMask {
    pub step: StepRecipe,
    bytes: Vec<u8>,
    mask: MaskFile,
    kept_scan: Kept<Scan>,
    scan: Arc<Scan>,
    marks: Marks,
    content: MaskContent,
    /// Its entry in the recipe.
    path: String,
    /// Its index among the masks if it is one already.
    at: Option<usize>,
}

/// A mask file that was read and applied to its scan.
struct ReadMask {
    mask: MaskFile,
    kept_scan: Kept<Scan>,
    scan: Arc<Scan>,
    marks: Marks,
}

impl NewMask {
    /// Whether numbers or a picture label the whole scan, so that nothing is left to the template.
    fn labels_all(&self) -> bool {
        /// Vertices with different labels may share a pixel of a picture, and then have none.
        const NEARLY_ALL: f64 = 0.99;
        let labelled = self.marks.labels.iter().flatten().count();
        self.content == MaskContent::Marks && labelled as f64 > NEARLY_ALL * self.marks.labels.len() as f64
    }
}

impl Writer {
    /// Adds a mask to a garment, or replaces the mask of the same file. Of a file with labels of several classes, `classes`
    /// are those of the garment; none for a file of the garment alone. On an error the session is unchanged.
    pub fn add_mask(&mut self, layer: &str, file: &Path, classes: &[i64]) -> Result<MaskReport, SessionError> {
        let new = self.session.read_new_mask(layer, file, classes)?;
        self.session.refuse_to_erase_all(&new, file)?;
        let change = self.put_mask(&new, file)?;
        self.save(&change)?;
        let count = |label| count(&new.marks, label);
        Ok(MaskReport {
            added: count(true),
            erased: count(false),
            replaced: new.at.is_some(),
            pins_all: new.content == MaskContent::Everything || new.labels_all(),
        })
    }

    /// Inserts a mask into the recipe and returns the description of the change, which is not saved yet.
    pub(in crate::session) fn put_mask(&mut self, new: &NewMask, file: &Path) -> Result<String, SessionError> {
        let layer = &new.step.name;
        let from = || new.path.clone();
        let named = match new.content {
            MaskContent::File | MaskContent::Everything => {
                let hash = self.session.store.keep_bytes(&new.bytes)?;
                SourceFile { file: new.path.clone(), hash: Some(hash), ..SourceFile::default() }
            }
            MaskContent::Marks => self.anchored(layer, &LabelledSurface::of_marks(&new.scan, &new.marks), from())?,
            MaskContent::Painted => {
                self.anchored(layer, &LabelledSurface::of_painted(&new.scan, &new.marks), from())?
            }
        };
        let masks = &mut self.session.recipe.step_mut(layer)?.masks;
        match new.at {
            Some(at) => masks[at] = SourceFile { layer: masks[at].layer.take(), ..named },
            None => masks.push(named),
        }
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        Ok(format!("mask {layer} {name}"))
    }

    /// Anchors marks in space: writes points and labels to a file in the session.
    fn anchored(&self, layer: &str, marks: &LabelledSurface, from: String) -> Result<SourceFile, SessionError> {
        let mesh = marks.to_mesh();
        let mut bytes = Vec::new();
        let folder = self.session.dir().join(ANCHORED);
        let options = PlyOptions { double: true, ..PlyOptions::default() };
        write_ply(&mesh, &options, &mut bytes).map_err(|e| SessionError::bad_source(&folder, e))?;
        let hash = self.session.store.keep_bytes(&bytes)?;
        // Named by its content, so that older states of the session keep their own file.
        let file = format!("{ANCHORED}/{layer}-{}.ply", hash.short());
        std::fs::create_dir_all(&folder).map_err(|e| SessionError::writing(&folder, e))?;
        write_whole(&self.session.dir().join(&file), &bytes)?;
        Ok(SourceFile { file, hash: Some(hash), from: Some(from), layer: None })
    }

    /// Removes masks from a garment: the one of that number or file, or all; returns their files.
    pub fn remove_mask(&mut self, layer: &str, which: Option<&str>) -> Result<Vec<String>, SessionError> {
        let mut step = self.session.garment_step(layer)?.clone();
        let gone: Vec<SourceFile> = match which {
            None => std::mem::take(&mut step.masks),
            Some(which) => vec![step.masks.remove(self.session.mask_at(&step, which)?)],
        };
        if gone.is_empty() {
            return Err(no_such_mask(&step, format!("'{layer}' has no mask")));
        }
        self.session.recipe.step_mut(layer)?.masks = step.masks;
        self.save(&format!("mask {layer} {} removed", which.unwrap_or("all")))?;
        Ok(gone.iter().map(|m| m.edited().to_string()).collect())
    }
}

impl Session {
    /// The masks of a garment, or of all.
    pub fn masks(&self, layer: Option<&str>) -> Result<Vec<MaskInfo>, SessionError> {
        if let Some(layer) = layer {
            self.garment_step(layer)?;
        }
        let mut found = Vec::new();
        let named = self.recipe.steps.iter().filter(|s| layer.is_none_or(|l| l == s.name));
        for step in named.filter(|s| !s.masks.is_empty()) {
            let (kept, scan) = self.scan_of(step)?;
            let of = FileInput::of(self, &step.source());
            for (i, source) in step.masks.iter().enumerate() {
                let input = MaskInput::of(self, &step.name, source);
                let mask = input.read(&self.store)?;
                let marks = input.marks(&mask, &self.store, &of, kept, &scan)?;
                found.push(MaskInfo {
                    layer: step.name.clone(),
                    number: i + 1,
                    file: source.edited().to_string(),
                    kind: mask.kind(),
                    added: count(&marks, true),
                    erased: count(&marks, false),
                });
            }
        }
        Ok(found)
    }

    /// Every mask file that a person may edit: garment and path.
    pub fn mask_files(&self) -> Vec<(String, PathBuf)> {
        let of_step =
            |s: &StepRecipe| s.masks.iter().map(|m| (s.name.clone(), self.resolve(m.edited()))).collect::<Vec<_>>();
        self.recipe.steps.iter().flat_map(of_step).collect()
    }

    /// Writes a file in which the user can correct a garment: its segmented scan as `.ply`, with the garment in red;
    /// one label per vertex as `.npy`; a picture over the scan's texture coordinates as `.png`, with the garment in
    /// white; or a `.jsonl` without strokes. Returns the number of vertices.
    ///
    /// **Errors** where there is a painted file already, unless `outputs` replaces it.
    pub fn write_mask_template(
        &self,
        layer: &str,
        target: &Path,
        outputs: &mut Outputs,
    ) -> Result<usize, SessionError> {
        self.garment_step(layer)?;
        outputs.claim(target, Content::Named)?;
        let steps = self.posed_steps(Some(layer))?;
        let Some((posed, labels)) = steps.last().and_then(|posed| Some((posed, posed.labels.as_ref()?))) else {
            return Err(SessionError::MaskOnBody);
        };
        let bad = |e: crate::formats::FormatError| SessionError::bad_source(target, e);
        let mut bytes = Vec::new();
        match target.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
            Some("ply") => {
                let mesh = LabelledSurface::of_marks(&posed.scan, &Marks::of_labels(labels)).to_template();
                write_ply(&mesh, &PlyOptions { double: true, ..PlyOptions::default() }, &mut bytes).map_err(bad)?;
            }
            Some("npy") => {
                let numbers: Vec<i32> = labels.0.iter().map(|&l| i32::from(l)).collect();
                write_npy(&NpyArray::vector(numbers), &mut bytes).map_err(bad)?;
            }
            Some("png") => {
                let of = FileInput::of(self, &posed.step.source());
                // A recording of frames has no texture coordinates.
                let file = of.mesh(&self.store)?.unwrap_or_default();
                let picture = labels.to_picture(&posed.scan, &file).map_err(|e| of.fault(e))?;
                picture.write_png(&mut bytes).map_err(bad)?;
            }
            Some("jsonl") => {}
            _ => {
                return Err(SessionError::BadRequest {
                    what: format!("'{}' cannot be a mask for painting", target.display()),
                    hint: "end the name with .ply for Blender or MeshLab, .png for a picture over the scan's texture coordinates, .npy for a program, .jsonl for strokes"
                        .into(),
                });
            }
        }
        outputs.write_bytes(target, Content::Named, bytes)?;
        Ok(labels.0.len())
    }

    pub(in crate::session) fn garment_step(&self, layer: &str) -> Result<&StepRecipe, SessionError> {
        let step = self.recipe.step(layer)?;
        step.check_labelled().map(|()| step)
    }

    fn scan_of(&self, step: &StepRecipe) -> Result<(Kept<Scan>, Arc<Scan>), SessionError> {
        let kept = scan_of(&mut Walk::look(self), step)?;
        Ok((kept, self.store.load_shared(kept)?))
    }

    /// The index of the mask with that number, path or file name.
    fn mask_at(&self, step: &StepRecipe, which: &str) -> Result<usize, SessionError> {
        let path = relative_to(self.dir(), Path::new(which)).ok();
        let is = |m: &SourceFile| m.edited() == which || Some(m.edited()) == path.as_deref();
        let ends = |m: &SourceFile| Path::new(m.edited()).file_name().is_some_and(|n| n.to_string_lossy() == which);
        let number = which.parse().ok().filter(|n| (1..=step.masks.len()).contains(n)).map(|n: usize| n - 1);
        let by_name = || {
            let mut places = step.masks.iter().enumerate().filter(|(_, m)| ends(m)).map(|(i, _)| i);
            places.next().filter(|_| places.next().is_none())
        };
        step.masks
            .iter()
            .position(is)
            .or(number)
            .or_else(by_name)
            .ok_or_else(|| no_such_mask(step, format!("'{}' has no mask '{which}'", step.name)))
    }

    /// The evidence for a garment if it is up to date.
    pub(in crate::session) fn up_to_date_evidence(&self, layer: &str) -> Option<ContentHash> {
        let mut walk = Walk::look(self);
        // Later stages may be out of date.
        let _ = pipeline::steps(&mut walk, Some(layer));
        let is_up_to_date = walk.into_reports().iter().any(|r| r.step == layer && r.stage == Stage::Evidence);
        is_up_to_date.then(|| self.state.record(layer, Stage::Evidence)).flatten().map(|record| record.output)
    }

    /// Reads a mask and applies it to its scan.
    pub(in crate::session) fn read_new_mask(
        &self,
        layer: &str,
        file: &Path,
        classes: &[i64],
    ) -> Result<NewMask, SessionError> {
        self.garment_step(layer)?;
        let bytes = source::read(file)?;
        self.new_mask(layer, file, relative_to(self.dir(), file)?, bytes, classes)
    }

    /// Applies the bytes of a mask to its scan; the file, with this entry in the recipe, may not have them yet.
    pub(in crate::session) fn new_mask(
        &self,
        layer: &str,
        file: &Path,
        path: String,
        bytes: Vec<u8>,
        classes: &[i64],
    ) -> Result<NewMask, SessionError> {
        let step = self.garment_step(layer)?.clone();
        let at = step.masks.iter().position(|m| m.edited() == path);
        let layer_before = at.and_then(|at| step.masks[at].layer.as_deref());
        let ReadMask { mask, kept_scan, scan, marks } = self.read_mask(&step, file, &bytes, classes, layer_before)?;
        let (marks, content) = match &mask {
            // The file alone does not tell which class is the garment's.
            _ if !classes.is_empty() => (marks, MaskContent::Marks),
            // A file with unlabelled vertices tells itself what is pinned.
            MaskFile::Surface(surface) if surface.is_complete() && !surface.is_painted() => {
                let before = match surface.before_painting() {
                    Some(before) => {
                        let marks = before.marks_on(&scan, None).map_err(|e| SessionError::bad_source(file, e))?;
                        Some(marks)
                    }
                    None => self.labels_without(&step, kept_scan, &scan, at)?.map(|labels| Marks::of_labels(&labels)),
                };
                match before {
                    Some(before) => (marks.painted_over(&before.labels), MaskContent::Painted),
                    None => (marks, MaskContent::Everything),
                }
            }
            mask if mask.is_anchored() => (marks, MaskContent::File),
            _ => (marks, MaskContent::Marks),
        };
        Ok(NewMask { step, bytes, mask, kept_scan, scan, marks, content, path, at })
    }

    /// The marks of a mask file on the scan of a step; `layer_before` is the name that the layer had when they were painted.
    fn read_mask(
        &self,
        step: &StepRecipe,
        file: &Path,
        bytes: &[u8],
        classes: &[i64],
        layer_before: Option<&str>,
    ) -> Result<ReadMask, SessionError> {
        let mask = match classes {
            [] => MaskFile::read(file, bytes)?,
            classes => MaskFile::read_classes(file, bytes, classes)?,
        };
        let (kept_scan, scan) = self.scan_of(step)?;
        let of = FileInput::of(self, &step.source());
        let marks = MaskInput::new(file, &step.name, layer_before).marks(&mask, &self.store, &of, kept_scan, &scan)?;
        Ok(ReadMask { mask, kept_scan, scan, marks })
    }

    /// Everything that a mask file says of the scan of a layer.
    ///
    /// **Shapes** one label per vertex of the scan; `None` where the file has none.
    pub(in crate::session) fn labels_in(
        &self,
        layer: &str,
        file: &Path,
        classes: &[i64],
    ) -> Result<PerVertex<Option<bool>>, SessionError> {
        let step = self.garment_step(layer)?;
        Ok(self.read_mask(step, file, &source::read(file)?, classes, None)?.marks.labels)
    }

    /// The labels of a garment when it was last built, with the masks before number `at`, or all masks; `None` if it was
    /// never built on this scan.
    fn labels_without(
        &self,
        step: &StepRecipe,
        kept_scan: Kept<Scan>,
        scan: &Scan,
        at: Option<usize>,
    ) -> Result<Option<Labels>, SessionError> {
        let is_of_scan = |record: &&StageRecord| record.from["scan"] == serde_json::json!(kept_scan.hash);
        let record = self.state.record(&step.name, Stage::Evidence).filter(is_of_scan);
        let Some(output) = record.map(|record| record.output).filter(|output| self.store.has(*output)) else {
            return Ok(None);
        };
        let masks = MasksOfScan::of(self, step);
        let labelling = Labelling::load(&self.store, Kept::named(output), &masks, kept_scan, scan)?;
        let adjacency = self.store.prepared(kept_scan.hash, || Adjacency::prepare(&scan.mesh));
        let marks = masks.marks(&self.store, kept_scan, scan, |i| at.is_none_or(|at| i < at))?;
        let segmentation = labelling.corrected(&scan.mesh, &adjacency, &marks);
        Ok(Some(segmentation.map_err(|e| SessionError::stage(&step.name, Stage::Segment, e))?.labels))
    }

    /// Refuses a mask that leaves nothing of the garment, as far as that is known before a build.
    pub(in crate::session) fn refuse_to_erase_all(&self, new: &NewMask, file: &Path) -> Result<(), SessionError> {
        let NewMask { step, scan, at, kept_scan: kept, .. } = new;
        let masks = MasksOfScan::of(self, step);
        let before = masks.marks(&self.store, *kept, scan, |i| at.is_none_or(|at| i < at))?;
        let after = masks.marks(&self.store, *kept, scan, |i| at.is_some_and(|at| i > at))?;
        let evidence = self.up_to_date_evidence(&step.name);
        let labelling = |evidence| Labelling::load(&self.store, Kept::named(evidence), &masks, *kept, scan);
        let labelling = evidence.map(labelling).transpose()?;
        let adjacency = self.store.prepared(kept.hash, || Adjacency::prepare(&scan.mesh));
        let left = |marks: &Marks| -> Result<bool, SessionError> {
            let all = before.clone().then(marks).then(&after);
            let Some(labelling) = &labelling else { return Ok(all.labels.iter().any(|m| *m != Some(false))) };
            let segmentation = labelling
                .corrected(&scan.mesh, &adjacency, &all)
                .map_err(|e| SessionError::stage(&step.name, Stage::Segment, e))?;
            Ok(is_something(scan, &segmentation.labels))
        };
        if left(&new.marks)? {
            return Ok(());
        }
        let line = match &new.mask {
            MaskFile::Strokes(strokes) => {
                let mut line = None;
                for n in 1..=strokes.len() {
                    if let Ok(marks) = Marks::paint(scan, &strokes[..n])
                        && !left(&marks)?
                    {
                        line = Some(strokes[n - 1].line);
                        break;
                    }
                }
                line
            }
            _ => None,
        };
        Err(SessionError::nothing_left(file, line, &step.name))
    }
}

fn no_such_mask(step: &StepRecipe, what: String) -> SessionError {
    let known: Vec<String> =
        step.masks.iter().enumerate().map(|(i, m)| format!("{}, which is '{}'", i + 1, m.edited())).collect();
    SessionError::BadRequest {
        what,
        hint: if known.is_empty() {
            "`overcoat mask list` shows all masks".into()
        } else {
            format!("its masks are {}", known.join(", "))
        },
    }
}
