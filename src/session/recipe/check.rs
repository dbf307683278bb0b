//! The rules of a recipe.

use super::names::{is_file_name, is_same_file_name};
use super::parameters::{self, has_parameters};
use super::steps::{BODY_STEP, Recipe, StepRecipe};
use super::variants::StepKind;
use crate::scan::ScanParams;
use crate::session::error::SessionError;
use crate::session::stage::Stage;
use std::ops::RangeInclusive;

/// Names that export uses for files and folders of its own.
const RESERVED_NAMES: [&str; 4] = ["body", "joints", "labels", "weights"];

impl Recipe {
    /// Checks whether a garment of that name can be added.
    pub fn check_new_garment(&self, name: &str) -> Result<(), SessionError> {
        check_name(name, &Some(String::new()))?;
        check_is_new(name, &self.steps)
    }

    /// Appends a step, or replaces the one with its name.
    pub(in crate::session) fn put_step(&mut self, step: StepRecipe, replace: bool) -> Result<(), SessionError> {
        match self.steps.iter().position(|s| s.name == step.name) {
            // A bare scan is what an estimated body lacks.
            Some(at) if self.steps[at].estimated => self.steps[at] = step,
            Some(_) if !replace => return Err(SessionError::DuplicateStep { name: step.name }),
            Some(at) => self.steps[at] = step,
            None => self.steps.insert(self.place_of_new(std::slice::from_ref(&step)), step),
        }
        self.link_templates();
        self.hair_follows_body();
        self.check().map_err(|fault| fault.error)
    }

    /// Checks a recipe: the body comes first and is the only step without a template and without limits; names are unique
    /// and valid file names; each parameter belongs to a stage of its step and has an allowed value.
    pub(in crate::session) fn check(&self) -> Result<(), Fault> {
        for (i, step) in self.steps.iter().enumerate() {
            let at = |key: &[&str], error| Fault {
                step: Some(i as u32),
                key: key.iter().map(|k| k.to_string()).collect(),
                error,
            };
            check_name(&step.name, &step.template).map_err(|e| at(&["name"], e))?;
            check_is_new(&step.name, &self.steps[..i]).map_err(|e| at(&["name"], e))?;
            if i == 0 && step.name != BODY_STEP {
                return Err(at(&["name"], SessionError::GarmentBeforeBody { name: step.name.clone() }));
            }
            if !step.masks.is_empty() {
                step.check_labelled().map_err(|e| at(&["mask"], e))?;
            }
            check_tryon(step).map_err(|(key, e)| at(&[key], e))?;
            check_extent(step).map_err(|(key, e)| at(&[key], e))?;
            check_reading(step).map_err(|(key, e)| at(&[key], e))?;
            for stage in Stage::all() {
                let Some(section) = stage.section() else { continue };
                for (name, setting) in step.settings(stage) {
                    let here = |e| at(&[section, name], e);
                    check_stage(&step.name, step.kind(), stage).map_err(here)?;
                    if !has_parameters(step.kind(), stage) {
                        return Err(at(
                            &[section, name],
                            SessionError::BadRequest {
                                what: format!("the stage {stage} has no parameters in the step '{}'", step.name),
                                hint: "name a garment".into(),
                            },
                        ));
                    }
                    parameters::check(stage, name, setting).map_err(here)?;
                }
            }
        }
        self.check_outfits().map_err(|(i, error)| Fault { step: Some(i as u32), key: vec!["outfit".into()], error })?;
        self.check_hair().map_err(|(i, error)| Fault { step: Some(i as u32), key: vec!["template".into()], error })?;
        self.check_estimated().map_err(|(i, key, error)| Fault {
            step: Some(i as u32),
            key: vec![key.into()],
            error,
        })?;
        let at_animations = |error| Fault { step: None, key: vec!["animation".into()], error };
        self.check_animations().map_err(at_animations)
    }
}

/// An error in a recipe, and its place.
pub(in crate::session) struct Fault {
    /// Index of the step; `None` for a key outside the steps.
    pub(super) step: Option<u32>,
    /// The path to the key, from the step.
    pub(super) key: Vec<String>,
    pub error: SessionError,
}

/// Checks that a step has a stage.
pub(in crate::session) fn check_stage(step: &str, kind: StepKind, stage: Stage) -> Result<(), SessionError> {
    let stages = kind.stages();
    match stages.contains(&stage) {
        true => Ok(()),
        false => Err(SessionError::BadRequest {
            what: format!("the step '{step}' has no stage '{stage}'"),
            hint: format!("it has {}", stages.iter().map(Stage::to_string).collect::<Vec<_>>().join(", ")),
        }),
    }
}

/// Exports name files after the steps, so names must differ in more than upper and lower case.
fn check_is_new(name: &str, steps: &[StepRecipe]) -> Result<(), SessionError> {
    match steps.iter().find(|s| is_same_file_name(&s.name, name)) {
        None => Ok(()),
        Some(there) if there.name == name => Err(SessionError::DuplicateStep { name: name.into() }),
        Some(there) => Err(SessionError::BadRequest {
            what: format!("the name '{name}' differs from the step '{}' only in upper and lower case", there.name),
            hint: "choose another name: some file systems do not tell the two apart".into(),
        }),
    }
}

fn check_name(name: &str, template: &Option<String>) -> Result<(), SessionError> {
    if !is_file_name(name, &['-', '_']) {
        return Err(SessionError::BadName { name: name.into() });
    }
    match (name == BODY_STEP, template) {
        (true, Some(_)) => Err(SessionError::BodyWithTemplate),
        (false, None) => Err(SessionError::GarmentWithoutTemplate { name: name.into() }),
        (false, Some(_)) if RESERVED_NAMES.iter().any(|own| is_same_file_name(own, name)) => {
            Err(SessionError::BadName { name: name.into() })
        }
        _ => Ok(()),
    }
}

impl StepRecipe {
    /// Checks that the step labels a part of its scan, which masks correct.
    pub(in crate::session) fn check_labelled(&self) -> Result<(), SessionError> {
        match (self.is_body(), self.tryon) {
            (true, _) => Err(SessionError::MaskOnBody),
            (_, true) => Err(SessionError::MaskWithoutScan { name: self.name.clone() }),
            _ => Ok(()),
        }
    }
}

/// A garment that is tried on has no scan that labels or limits could refer to.
fn check_tryon(step: &StepRecipe) -> Result<(), (&'static str, SessionError)> {
    if !step.tryon {
        if step.method.is_some() {
            let what = format!("'{}' is scanned, and 'method' is how a garment from a file is put on", step.name);
            let hint = "leave it out, or give the method of a stage, as `--set pose.method=paper`".into();
            return Err(("method", SessionError::BadRequest { what, hint }));
        }
        return match step.fabric {
            None => Ok(()),
            Some(_) => Err((
                "fabric",
                SessionError::BadRequest {
                    what: format!("'{}' is scanned, and its kind says what it is made of", step.name),
                    hint: "give the fabric of an animation: `overcoat animate CLIP --fabric LAYER=FABRIC`".into(),
                },
            )),
        };
    }
    let given = [
        ("tryon", step.is_body()),
        ("outfit", step.outfit.is_some()),
        ("until", step.until.is_some()),
        ("sleeve", step.sleeve.is_some()),
        ("up", step.up.is_some()),
        ("faces", step.faces.is_some()),
        ("voxel_mm", step.voxel_mm.is_some()),
    ];
    match given.into_iter().find(|(_, given)| *given) {
        None => Ok(()),
        Some((key, _)) => Err((
            key,
            SessionError::BadRequest {
                what: format!(
                    "'{}' is a garment that was put on from a file, without a scan: it has no '{key}'",
                    step.name
                ),
                hint: "change the garment's file, and try it on again".into(),
            },
        )),
    }
}

/// Limits are for garments.
fn check_extent(step: &StepRecipe) -> Result<(), (&'static str, SessionError)> {
    for (key, option, value) in [("until", "--until", &step.until), ("sleeve", "--sleeve", &step.sleeve)] {
        if step.is_body() && value.is_some() {
            return Err((key, SessionError::BodyWithExtent { option }));
        }
    }
    Ok(())
}

/// How the scan is read: faces, voxels, and what becomes the body.
fn check_reading(step: &StepRecipe) -> Result<(), (&'static str, SessionError)> {
    /// Millimetres: finer voxels only resolve noise, coarser ones lose arms.
    const VOXELS_MM: RangeInclusive<f64> = 1.0..=20.0;
    let wrong = |what: String, hint: String| SessionError::BadRequest { what, hint };
    if let Some(faces) = step.faces {
        let params = ScanParams { faces, ..ScanParams::default() };
        params.check().map_err(|e| ("faces", wrong(e.to_string(), e.hint().unwrap_or_default())))?;
    }
    if let Some(mm) = step.voxel_mm.filter(|mm| !VOXELS_MM.contains(mm)) {
        let what = format!("voxels of {mm} mm are too {}", if mm < *VOXELS_MM.start() { "fine" } else { "coarse" });
        return Err(("voxel_mm", wrong(what, "give --voxel between 1 and 20 millimetres; 4 is the default".into())));
    }
    if step.surface.is_some() && !step.is_body() {
        let what = format!("'{}' is a garment: only the body has a surface to choose", step.name);
        return Err(("surface", wrong(what, "leave --surface out".into())));
    }
    Ok(())
}
