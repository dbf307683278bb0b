//! `KEY=VALUE`: a change of a recipe for another session.

use super::step_key::{StepKey, absolute};
use super::steps::{Recipe, SourceFile, StepRecipe};
use crate::session::error::SessionError;
use std::path::Path;

/// One difference from the recipe.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Assignment {
    /// `STEP` or `STEP.scan` for the step's scan, `STEP.until`, `STEP.stack.clearance` …, `body_model`.
    pub key: String,
    /// As typed.
    pub value: String,
}

/// The key of the body model.
const BODY_MODEL: &str = "body_model";

impl Assignment {
    /// Reads `KEY=VALUE` of a recipe.
    pub fn parse(text: &str) -> Result<Self, SessionError> {
        Self::read(text, KEYS)
    }

    /// Reads `KEY=VALUE` of one step.
    pub fn of_step(text: &str) -> Result<Self, SessionError> {
        Self::read(text, KEYS_OF_STEP)
    }

    /// Whether it sets a step's scan, so that the value is a path.
    pub fn is_path(&self) -> bool {
        ["path", "scan"].contains(&self.key.as_str())
    }

    fn read(text: &str, keys: &str) -> Result<Self, SessionError> {
        match text.split_once('=') {
            Some((key, value)) if !key.trim().is_empty() => {
                Ok(Self { key: key.trim().into(), value: value.trim().into() })
            }
            _ => Err(SessionError::BadRequest { what: format!("'{text}' has no key or no ="), hint: keys.into() }),
        }
    }
}

const KEYS: &str = "say STEP=FILE for another scan, STEP.until=PLACE (or template, sleeve, unit, height, up, faces, remesh, mask), \
                    STEP.STAGE.PARAMETER=VALUE, or body_model=FILE";

/// The keys of a step, for hints.
pub(in crate::session) const KEYS_OF_STEP: &str = "say path=FILE, template=KIND, until=PLACE, sleeve=LENGTH, fabric, unit, height, up, \
                                                   faces, remesh, surface, voxel, or STAGE.PARAMETER=VALUE; KEY= resets";

/// What was omitted from a recipe because it belongs to another scan.
pub(in crate::session) type LeftOut = Vec<String>;

/// Changes the recipe. Paths in `set` are relative to `from`; in the recipe they become absolute, without a hash.
pub(in crate::session) fn apply(recipe: &mut Recipe, set: &[Assignment], from: &Path) -> Result<LeftOut, SessionError> {
    let mut left_out = LeftOut::new();
    let mut masks_given = Vec::new();
    for Assignment { key, value } in set {
        if key == BODY_MODEL {
            recipe.body = Some(SourceFile { file: absolute(from, value)?, ..SourceFile::default() });
            continue;
        }
        let (name, what) = key.split_once('.').unwrap_or((key, "scan"));
        let known: Vec<String> = recipe.steps.iter().map(|s| s.name.clone()).collect();
        let Some(step) = recipe.steps.iter_mut().find(|s| s.name == name) else {
            return Err(SessionError::BadRequest {
                what: format!(
                    "'{key}' is not a key of this recipe: it has no step '{name}'; there are {}",
                    known.join(", ")
                ),
                hint: KEYS.into(),
            });
        };
        if what == "mask" {
            step.check_labelled()?;
            if !masks_given.contains(&step.name) {
                step.masks.clear();
                masks_given.push(step.name.clone());
            }
            if !value.is_empty() {
                step.masks.push(SourceFile { file: absolute(from, value)?, ..SourceFile::default() });
            }
            continue;
        }
        let (name, outfit) = (step.name.clone(), step.outfit.clone());
        let no_such =
            || SessionError::BadRequest { what: format!("'{key}' is not a key of a recipe"), hint: KEYS.into() };
        StepKey::parse(what)?.ok_or_else(no_such)?.set(step, key, value, from)?;
        recipe.share_in_outfit(&name);
        if ["scan", "path"].contains(&what) {
            let with_scan = |s: &&mut StepRecipe| s.name == name || (outfit.is_some() && s.outfit == outfit);
            let unfit = |s: &&mut StepRecipe| !s.masks.is_empty() && !masks_given.contains(&s.name);
            for step in recipe.steps.iter_mut().filter(with_scan).filter(unfit) {
                left_out.push(format!(
                    "{} mask{} of '{}': painted on another scan",
                    step.masks.len(),
                    if step.masks.len() == 1 { "" } else { "s" },
                    step.name
                ));
                step.masks.clear();
            }
        }
    }
    recipe.link_templates();
    recipe.check().map_err(|fault| fault.error)?;
    for step in recipe.steps.iter().filter(|s| !s.is_body()) {
        recipe.garment_of(step)?;
    }
    Ok(left_out)
}
