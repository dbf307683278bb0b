//! Strokes that are painted on a page: appended to a brush file of the session, and taken from its end again.
//!
//! The file is a mask like any other: a person may edit it, and `replay` gives the same result. It is written before the
//! change is recorded, so that a stroke is never lost; a stroke with an id is never applied twice.

use super::recut::Recut;
use crate::segment::Stroke;
use crate::session::error::SessionError;
use crate::session::open::{Session, Writer};
use crate::session::pipeline::{Event, FileInput};
use crate::session::recipe::{SourceFile, StepRecipe};
use crate::session::store::{ContentHash, journal, read_file, write_whole};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// The folder of the brush files that pages write.
const PAINTED: &str = "paint";

/// A garment cut again after strokes were painted or taken back.
pub struct Painted {
    /// The garment, as it is now.
    pub recut: Recut,
    /// Whether the strokes were there already, so that nothing changed.
    pub was_there: bool,
    /// The strokes that were taken back.
    pub taken: Vec<Stroke>,
}

/// The brush file of a layer.
struct Sheet {
    /// Its entry in the recipe.
    entry: String,
    place: PathBuf,
    /// Its index among the layer's masks, if it is one.
    at: Option<usize>,
    /// Its text according to the recipe.
    recorded: String,
    /// Its text on the disk.
    found: Option<String>,
    /// The text that counts.
    text: String,
}

/// What a stroke is called: its id, or else a hash of its line.
fn name_of(line: &str) -> String {
    let stroke = serde_json::from_str::<Stroke>(line).ok();
    stroke.and_then(|stroke| stroke.id).unwrap_or_else(|| ContentHash::of(line.trim().as_bytes()).short().to_string())
}

fn strokes_in(text: &str) -> impl DoubleEndedIterator<Item = &str> {
    text.lines().filter(|line| !line.trim().is_empty())
}

impl Session {
    /// The layers that can be painted: those whose labels come from a scan.
    pub fn paintable_layers(&self) -> Vec<String> {
        let steps = self.recipe.steps.iter().filter(|step| step.check_labelled().is_ok());
        steps.map(|step| step.name.clone()).collect()
    }

    /// The garments that one scan shows with this one for the first time, itself included, innermost first: a stroke on one may
    /// change the labels of all.
    pub fn layers_labelled_with(&self, layer: &str) -> Result<Vec<String>, SessionError> {
        let outfit = self.recipe.outfit_of(self.garment_step(layer)?);
        Ok(outfit.iter().map(|step| step.name.clone()).collect())
    }

    /// The names of the strokes in a layer's brush file, in order; strokes that were painted as one have one name.
    pub fn painted_strokes(&self, layer: &str) -> Result<Vec<String>, SessionError> {
        let sheet = self.sheet(layer)?;
        let mut names: Vec<String> = strokes_in(&sheet.text).map(name_of).collect();
        names.dedup();
        Ok(names)
    }

    /// Whether the layer's brush file holds strokes that are not applied yet.
    pub fn has_unapplied_strokes(&self, layer: &str) -> Result<bool, SessionError> {
        let sheet = self.sheet(layer)?;
        Ok(sheet.text != sheet.recorded)
    }

    fn sheet(&self, layer: &str) -> Result<Sheet, SessionError> {
        let step = self.garment_step(layer)?;
        let (entry, at) = self.sheet_entry(step);
        let place = self.resolve(&entry);
        let recorded = match at {
            Some(at) => text_of(&place, FileInput::of(self, &step.masks[at]).bytes(&self.store)?)?,
            None => String::new(),
        };
        let found = match read_file(&place) {
            Ok(bytes) => Some(text_of(&place, bytes)?),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => None,
            Err(e) => return Err(SessionError::reading(&place, e)),
        };
        let text = match &found {
            // A file as it was before `undo` or on another branch: the session counts. Otherwise somebody edited it, or
            // the program was stopped between file and session: the file counts.
            Some(found) if *found != recorded && !self.has_recorded(found)? => found.clone(),
            _ => recorded.clone(),
        };
        Ok(Sheet { entry, place, at, recorded, found, text })
    }

    /// The last mask if a page wrote it: what is painted now must count more than any earlier mask. Otherwise a new file.
    fn sheet_entry(&self, step: &StepRecipe) -> (String, Option<usize>) {
        let is_own = |mask: &SourceFile| mask.from.is_none() && mask.file.starts_with(&format!("{PAINTED}/"));
        if let Some((at, mask)) = step.masks.iter().enumerate().next_back().filter(|(_, mask)| is_own(mask)) {
            return (mask.file.clone(), Some(at));
        }
        let taken: BTreeSet<&str> =
            self.recipe.steps.iter().flat_map(|s| &s.masks).map(|mask| mask.file.as_str()).collect();
        let named = |n: usize| match n {
            1 => format!("{PAINTED}/{}.jsonl", step.name),
            n => format!("{PAINTED}/{}-{n}.jsonl", step.name),
        };
        let free = (1..).map(named).find(|name| !taken.contains(name.as_str()));
        (free.unwrap_or_else(|| named(1)), None)
    }

    /// Whether a recipe of the journal names a file of this text.
    fn has_recorded(&self, text: &str) -> Result<bool, SessionError> {
        let hash = ContentHash::of(text.as_bytes()).to_string();
        let mut recipes: Vec<ContentHash> =
            journal::read(self.dir())?.changes.iter().map(|change| change.recipe).collect();
        recipes.dedup();
        Ok(recipes.into_iter().any(|recipe| self.store.text(recipe).is_ok_and(|recipe| recipe.contains(&hash))))
    }
}

fn text_of(place: &std::path::Path, bytes: Vec<u8>) -> Result<String, SessionError> {
    String::from_utf8(bytes).map_err(|_| SessionError::BadRequest {
        what: format!("'{}' is not text, so it holds no brush strokes", place.display()),
        hint: "remove the file, or restore it".into(),
    })
}

impl Writer {
    /// Appends strokes to a layer's brush file and cuts the layer again. If that fails, nothing has changed, except that
    /// a stroke may be in the file already; then it is applied next time.
    ///
    /// **Requires** one id for all strokes; if the file has a stroke with it, the strokes are not added again.
    pub fn paint(
        &mut self,
        layer: &str,
        strokes: &[Stroke],
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<Painted, SessionError> {
        let sheet = self.session.sheet(layer)?;
        let id = strokes.iter().find_map(|stroke| stroke.id.as_ref());
        let was_there = id.is_some_and(|id| strokes_in(&sheet.text).any(|line| name_of(line) == *id));
        let mut text = sheet.text.clone();
        if !was_there {
            for stroke in strokes {
                if !text.is_empty() && !text.ends_with('\n') {
                    text.push('\n');
                }
                text += &serde_json::to_string(stroke).map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
                text.push('\n');
            }
        }
        let recut = self.with_strokes(layer, &sheet, text, on_event)?;
        Ok(Painted { recut, was_there, taken: Vec::new() })
    }

    /// Takes the last stroke, or the last ones that were painted as one, from the layer's brush file again.
    ///
    /// **Errors** if that is not the stroke of this name.
    pub fn take_back(
        &mut self,
        layer: &str,
        name: &str,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<Painted, SessionError> {
        let sheet = self.session.sheet(layer)?;
        let lines: Vec<&str> = strokes_in(&sheet.text).collect();
        let kept = lines.len() - lines.iter().rev().take_while(|line| name_of(line) == name).count();
        if kept == lines.len() {
            return Err(SessionError::BadRequest {
                what: format!("the last stroke of '{layer}' is another one by now"),
                hint: "look at it, then undo again".into(),
            });
        }
        let read = |line: &&str| serde_json::from_str::<Stroke>(line).ok();
        let taken: Vec<Stroke> = lines[kept..].iter().filter_map(read).collect();
        let text = lines[..kept].iter().map(|line| format!("{line}\n")).collect();
        let recut = self.with_strokes(layer, &sheet, text, on_event)?;
        Ok(Painted { recut, was_there: false, taken })
    }

    /// Makes `text` the layer's brush file and cuts the layer again, as one change.
    fn with_strokes(
        &mut self,
        layer: &str,
        sheet: &Sheet,
        text: String,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<Recut, SessionError> {
        let write = |text: &str| match strokes_in(text).next() {
            Some(_) => {
                let folder = sheet.place.parent().unwrap_or(&sheet.place);
                std::fs::create_dir_all(folder).map_err(|e| SessionError::writing(folder, e))?;
                write_whole(&sheet.place, text.as_bytes())
            }
            None => match std::fs::remove_file(&sheet.place) {
                Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(SessionError::writing(&sheet.place, e)),
                _ => Ok(()),
            },
        };
        let has_file = sheet.found.as_deref() == Some(text.as_str());
        if text == sheet.recorded {
            if !has_file && (sheet.found.is_some() || !text.is_empty()) {
                write(&text)?;
            }
            return self.recut(layer, on_event);
        }
        let write_new = |_: &Self| if has_file { Ok(()) } else { write(&text) };
        let changed = match (strokes_in(&text).next(), sheet.at) {
            (None, at) => self.without_sheet(layer, at, on_event, write_new),
            (Some(_), _) => {
                let (entry, bytes) = (sheet.entry.clone(), text.clone().into_bytes());
                let new = self.session.new_mask(layer, &sheet.place, entry, bytes, &[])?;
                self.recut_by(&new, &sheet.place, on_event, write_new)
            }
        };
        if changed.is_err() {
            // The file must not tell more than the session; if it cannot be restored, it counts next time.
            let _ = write(sheet.found.as_deref().unwrap_or_default());
        }
        changed
    }

    /// Removes a brush file from the layer's masks and cuts the layer again.
    fn without_sheet(
        &mut self,
        layer: &str,
        at: Option<usize>,
        on_event: &mut dyn FnMut(&Event),
        before_saving: impl FnOnce(&Self) -> Result<(), SessionError>,
    ) -> Result<Recut, SessionError> {
        let (recipe, state) = (self.session.recipe.clone(), self.session.state.clone());
        if let Some(at) = at {
            self.session.recipe.step_mut(layer)?.masks.remove(at);
        }
        let change = format!("mask {layer} painted strokes removed");
        let saved = self.cut_as(&change, layer, on_event).and_then(|recut| {
            before_saving(self)?;
            self.save(&change).map(|()| recut)
        });
        if saved.is_err() {
            (self.session.recipe, self.session.state) = (recipe, state);
        }
        saved
    }
}
