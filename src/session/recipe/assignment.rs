//! `KEY=VALUE`: a change of a recipe for another session.

use super::steps::{Recipe, SourceFile, StepRecipe};
use super::{garment_kind, parameters};
use crate::session::error::SessionError;
use crate::session::stage::Stage;
use std::path::{Path, PathBuf};

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
    /// Reads `KEY=VALUE`.
    pub fn parse(text: &str) -> Result<Self, SessionError> {
        match text.split_once('=') {
            Some((key, value)) if !key.trim().is_empty() => {
                Ok(Self { key: key.trim().into(), value: value.trim().into() })
            }
            _ => Err(SessionError::BadRequest { what: format!("'{text}' has no key or no ="), hint: KEYS.into() }),
        }
    }
}

const KEYS: &str = "say STEP=FILE for another scan, STEP.until=PLACE (or template, sleeve, unit, up, faces, mask), \
                    STEP.STAGE.PARAMETER=VALUE, or body_model=FILE";

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
            if step.is_body() {
                return Err(SessionError::MaskOnBody);
            }
            if !masks_given.contains(&step.name) {
                step.masks.clear();
                masks_given.push(step.name.clone());
            }
            if !value.is_empty() {
                step.masks.push(SourceFile { file: absolute(from, value)?, ..SourceFile::default() });
            }
            continue;
        }
        if what == "scan" && !step.masks.is_empty() && !masks_given.contains(&step.name) {
            left_out.push(format!(
                "{} mask{} of '{}': painted on another scan",
                step.masks.len(),
                if step.masks.len() == 1 { "" } else { "s" },
                step.name
            ));
            step.masks.clear();
        }
        set_in_step(step, what, value, key, from)?;
    }
    recipe.check().map_err(|fault| fault.error)?;
    for step in recipe.steps.iter().filter(|s| !s.is_body()) {
        garment_kind::of_step(step)?;
    }
    Ok(left_out)
}

fn set_in_step(step: &mut StepRecipe, what: &str, value: &str, key: &str, from: &Path) -> Result<(), SessionError> {
    let no_such = || SessionError::BadRequest { what: format!("'{key}' is not a key of a recipe"), hint: KEYS.into() };
    let cannot = |hint: String| SessionError::BadRequest { what: format!("{key} cannot be '{value}'"), hint };
    let text = Some(value.to_string());
    match what {
        "scan" => (step.scan, step.hash) = (absolute(from, value)?, None),
        "template" => step.template = text,
        "until" => step.until = text,
        "sleeve" => step.sleeve = text,
        "unit" => step.unit = Some(value.parse().map_err(|_| cannot("one of m, dm, cm, mm, in".into()))?),
        "up" => step.up = Some(value.parse().map_err(|_| cannot("an axis such as +y or -z".into()))?),
        "faces" => step.faces = Some(value.parse().map_err(|_| cannot("a number of faces".into()))?),
        _ => {
            let (stage, name) = what.split_once('.').ok_or_else(no_such)?;
            // The recipe keeps the scan's own parameters under `reading`.
            let stage = Stage::parse(if stage == "reading" { "scan" } else { stage }).ok_or_else(no_such)?;
            let setting = parameters::parameter(stage, name)?.read(value)?;
            step.settings_mut(stage).ok_or_else(no_such)?.insert(name.into(), setting);
        }
    }
    Ok(())
}

fn absolute(from: &Path, value: &str) -> Result<String, SessionError> {
    let path = from.join(value);
    let path: PathBuf = path.canonicalize().map_err(|e| SessionError::reading(&path, e))?;
    path.to_str().map(str::to_string).ok_or(SessionError::PathNotText { path: path.clone() })
}
