//! The list of steps: shown, shortened, renamed, reordered, and each step set to other values. Nothing is built.

use crate::session::error::SessionError;
use crate::session::open::{Input, Session, Writer, source};
use crate::session::pipeline::{Event, Forced, Walk, scan_of};
use crate::session::recipe::{Assignment, KEYS_OF_STEP, Recipe, StepKey, StepPlace, StepRecipe};
use serde::Serialize;
use std::path::Path;

/// A step of the recipe.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct StepInfo {
    /// Number from 1, in the order of dressing.
    pub number: usize,
    /// `body`, or the garment's name.
    pub name: String,
    /// The garment kind; `None` for the body.
    pub template: Option<String>,
    /// The outfit of which it is a garment.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outfit: Option<String>,
    /// The scan's file, as written in the recipe: relative to the session's folder where possible.
    pub file: String,
    /// Number of masks.
    pub masks: usize,
}

impl Session {
    /// The steps in order.
    pub fn steps(&self) -> Vec<StepInfo> {
        let info = |(i, step): (usize, &StepRecipe)| StepInfo {
            number: i + 1,
            name: step.name.clone(),
            template: step.template.clone(),
            outfit: step.outfit.clone(),
            file: step.scan.clone(),
            masks: step.masks.len(),
        };
        self.recipe.steps.iter().enumerate().map(info).collect()
    }
}

impl Writer {
    /// Removes a step with its masks; returns the files of the masks.
    ///
    /// **Errors** for the body while garments are there. On an error the session is unchanged.
    pub fn remove_step(&mut self, name: &str) -> Result<Vec<String>, SessionError> {
        let gone = self.session.recipe.remove_step(name)?;
        self.save(&format!("step {name} removed"))?;
        Ok(gone.masks.iter().map(|mask| mask.edited().to_string()).collect())
    }

    /// Renames a garment. Its masks and its results stay; the figure, which names its layers, is built again.
    ///
    /// **Errors** for the body, and for a name that is invalid or taken. On an error the session is unchanged.
    pub fn rename_step(&mut self, old: &str, new: &str) -> Result<bool, SessionError> {
        self.session.recipe.rename_step(old, new)?;
        if old == new {
            return Ok(false);
        }
        self.session.state.rename(old, new);
        self.session.timings.rename(old, new);
        self.save(&format!("step {old} renamed to {new}"))?;
        Ok(true)
    }

    /// Moves a garment before or after another step; returns whether the order changed.
    ///
    /// **Errors** for the body, and for a place before the body. On an error the session is unchanged.
    pub fn move_step(&mut self, name: &str, place: &StepPlace) -> Result<bool, SessionError> {
        let before = self.session.recipe.clone();
        self.session.recipe.move_step(name, place)?;
        if self.session.recipe == before {
            return Ok(false);
        }
        let side = match place {
            StepPlace::Before(_) => "before",
            StepPlace::After(_) => "after",
        };
        self.save(&format!("step {name} moved {side} {}", place.beside()))?;
        Ok(true)
    }

    /// Sets keys of a step; an empty value resets its key. Paths are relative to `from`. Returns what changed:
    /// `shirt.template tshirt → shirt`. If the scan is read differently now, it is read and cleaned at once.
    ///
    /// **Errors** for an unknown key, a value that the step cannot have, and a file that is not a scan. On an error the
    /// session is unchanged.
    pub fn set_step(
        &mut self,
        name: &str,
        set: &[Assignment],
        from: &Path,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<Vec<String>, SessionError> {
        let (mut recipe, before) = (self.session.recipe.clone(), self.session.recipe.step(name)?.clone());
        let keys = self.assign(&mut recipe, name, set, from)?;
        recipe.share_in_outfit(name);
        recipe.link_templates();
        recipe.check().map_err(|fault| fault.error)?;
        let step = recipe.step(name)?.clone();
        if !step.is_body() {
            recipe.garment_of(&step)?;
        }
        let changed: Vec<StepKey> = keys.into_iter().filter(|key| key.text(&before) != key.text(&step)).collect();
        // A file with other content under the old name is a change too.
        if step == before {
            return Ok(Vec::new());
        }
        let text = |key: &StepKey| format!("{name}.{} {} → {}", key.name(), key.text(&before), key.text(&step));
        let mut said: Vec<String> = changed.iter().map(text).collect();
        if step.hash != before.hash && step.scan == before.scan {
            said.push(format!("{name}.path {}: its content changed", step.scan));
        }
        let change = format!("set {}", said.join(", "));
        let reads_anew = step.hash != before.hash || changed.iter().any(|key| key.is_of_reading());
        let old = (std::mem::replace(&mut self.session.recipe, recipe), self.session.state.clone());
        if reads_anew {
            let mut walk = Walk::make(self, &change, &Forced::Nothing, on_event).at_once();
            if let Err(e) = scan_of(&mut walk, &step) {
                (self.session.recipe, self.session.state) = old;
                return Err(e);
            }
        }
        self.save(&change)?;
        Ok(said)
    }

    /// Sets the keys in `recipe` and returns them, each once.
    fn assign(
        &self,
        recipe: &mut Recipe,
        name: &str,
        set: &[Assignment],
        from: &Path,
    ) -> Result<Vec<StepKey>, SessionError> {
        let mut keys: Vec<StepKey> = Vec::new();
        for Assignment { key: typed, value } in set {
            let Some(key) = StepKey::parse(typed)? else { return Err(no_such_key(typed)) };
            if keys.contains(&key) {
                return Err(SessionError::BadRequest {
                    what: format!("{typed} is set twice"),
                    hint: "give each key once".into(),
                });
            }
            let step = recipe.step_mut(name)?;
            match key {
                StepKey::Scan if !value.is_empty() => {
                    let path = from.join(value);
                    let named = source::named(self.session.dir(), &path, Input::at(&path)?.hash()?)?;
                    (step.scan, step.hash) = (named.file, named.hash);
                }
                _ => key.set(step, typed, value, from)?,
            }
            keys.push(key);
        }
        Ok(keys)
    }
}

fn no_such_key(typed: &str) -> SessionError {
    let hint = match typed {
        "mask" | "masks" => "`overcoat mask` adds, lists and removes masks",
        "name" => "`overcoat step rename` renames a step",
        _ => KEYS_OF_STEP,
    };
    SessionError::BadRequest { what: format!("'{typed}' is not a key of a step"), hint: hint.into() }
}
