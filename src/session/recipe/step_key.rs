//! The keys of a step, as `step set` and `replay --set` name them.

use super::parameters::{self, Parameter, parameters_of};
use super::steps::{BodySurface, StepRecipe};
use crate::session::error::SessionError;
use crate::session::stage::Stage;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// A key of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::session) enum StepKey {
    /// The scan's file.
    Scan,
    Template,
    Until,
    Sleeve,
    Fabric,
    Unit,
    Height,
    Up,
    Faces,
    Remesh,
    Surface,
    Voxel,
    /// A parameter of a stage.
    Parameter(&'static Parameter),
}

impl StepKey {
    /// The key of that name: `template`, `segment.smoothness`, or an option of `scan` without its dashes.
    pub fn parse(name: &str) -> Result<Option<Self>, SessionError> {
        let plain = name.replace('-', "_");
        Ok(Some(match plain.as_str() {
            "scan" | "path" => Self::Scan,
            "template" => Self::Template,
            "until" => Self::Until,
            "sleeve" => Self::Sleeve,
            "fabric" => Self::Fabric,
            "unit" => Self::Unit,
            "height" => Self::Height,
            "up" => Self::Up,
            "faces" => Self::Faces,
            "remesh" => Self::Remesh,
            "surface" => Self::Surface,
            "voxel" | "voxel_mm" => Self::Voxel,
            "hair" => Self::Parameter(parameters::parameter(Stage::Fit, "hair")?),
            of_stage => match of_stage.split_once('.') {
                Some((stage, name)) => {
                    // The recipe keeps the scan's own parameters under `reading`.
                    let stage = Stage::parse(if stage == "reading" { "scan" } else { stage });
                    let Some(stage) = stage else { return Ok(None) };
                    Self::Parameter(parameters::parameter(stage, name)?)
                }
                None => match parameters_of(Stage::Scan).find(|p| p.name == of_stage) {
                    Some(parameter) => Self::Parameter(parameter),
                    None => return Ok(None),
                },
            },
        }))
    }

    /// Sets the key of a step; an empty value resets it to its default. `key` is the name as typed, for messages. A path
    /// is relative to `from`; in the recipe it becomes absolute, without a hash.
    pub fn set(self, step: &mut StepRecipe, key: &str, value: &str, from: &Path) -> Result<(), SessionError> {
        let cannot =
            |hint: &str| SessionError::BadRequest { what: format!("{key} cannot be '{value}'"), hint: hint.into() };
        let text = (!value.is_empty()).then(|| value.to_string());
        match self {
            Self::Scan if value.is_empty() => return Err(cannot("name a file: a step without a scan is removed")),
            Self::Scan => (step.scan, step.hash) = (absolute(from, value)?, None),
            Self::Template => step.template = text,
            Self::Until => step.until = text,
            Self::Sleeve => step.sleeve = text,
            Self::Fabric => step.fabric = text,
            Self::Unit => step.unit = read(value).map_err(|()| cannot("one of m, dm, cm, mm, in"))?,
            Self::Height => step.height = read(value).map_err(|()| cannot("a height in metres"))?,
            Self::Up => step.up = read(value).map_err(|()| cannot("an axis such as +y or -z"))?,
            Self::Faces => step.faces = read(value).map_err(|()| cannot("a number of faces"))?,
            Self::Remesh => step.remesh = read(value).map_err(|()| cannot("quads or quads:COUNT, from 1000"))?,
            Self::Voxel => step.voxel_mm = read(value).map_err(|()| cannot("a length in millimetres"))?,
            Self::Surface => {
                step.surface = match value {
                    "" => None,
                    "template" => Some(BodySurface::Template),
                    "scan" => Some(BodySurface::Scan),
                    _ => return Err(cannot("template or scan")),
                }
            }
            Self::Parameter(parameter) => {
                let settings = step.settings_mut(parameter.stage).expect("a stage with parameters has a section");
                match value {
                    "" => settings.remove(parameter.name),
                    _ => settings.insert(parameter.name.into(), parameter.read(value)?),
                };
            }
        }
        Ok(())
    }

    /// Its name in messages: `template`, `segment.smoothness`.
    pub fn name(self) -> String {
        match self {
            Self::Scan => "path".into(),
            Self::Template => "template".into(),
            Self::Until => "until".into(),
            Self::Sleeve => "sleeve".into(),
            Self::Fabric => "fabric".into(),
            Self::Unit => "unit".into(),
            Self::Height => "height".into(),
            Self::Up => "up".into(),
            Self::Faces => "faces".into(),
            Self::Remesh => "remesh".into(),
            Self::Surface => "surface".into(),
            Self::Voxel => "voxel".into(),
            Self::Parameter(parameter) => format!("{}.{}", parameter.stage, parameter.name),
        }
    }

    /// Its value in a step as text.
    pub fn text(self, step: &StepRecipe) -> String {
        /// What the program does where the recipe sets nothing.
        const DEFAULT: &str = "default";
        fn or_default(value: &Option<impl Display>) -> String {
            value.as_ref().map_or(DEFAULT.into(), ToString::to_string)
        }
        match self {
            Self::Scan => step.scan.clone(),
            Self::Template => or_default(&step.template),
            Self::Until => or_default(&step.until),
            Self::Sleeve => or_default(&step.sleeve),
            Self::Fabric => or_default(&step.fabric),
            Self::Unit => or_default(&step.unit),
            Self::Height => or_default(&step.height),
            Self::Up => or_default(&step.up),
            Self::Faces => or_default(&step.faces),
            Self::Remesh => or_default(&step.remesh),
            Self::Voxel => or_default(&step.voxel_mm),
            Self::Surface => match step.surface {
                None => DEFAULT.into(),
                Some(BodySurface::Template) => "template".into(),
                Some(BodySurface::Scan) => "scan".into(),
            },
            Self::Parameter(parameter) => {
                let set = step.settings(parameter.stage).get(parameter.name);
                set.map_or_else(|| parameter.default(), ToString::to_string)
            }
        }
    }

    /// Whether it changes how the scan's file is read.
    pub fn is_of_reading(self) -> bool {
        match self {
            Self::Scan | Self::Unit | Self::Height | Self::Up | Self::Faces | Self::Remesh | Self::Voxel => true,
            Self::Parameter(parameter) => parameter.stage == Stage::Scan,
            Self::Template | Self::Until | Self::Sleeve | Self::Fabric | Self::Surface => false,
        }
    }
}

/// `None` for an empty text.
fn read<T: FromStr>(text: &str) -> Result<Option<T>, ()> {
    if text.is_empty() { Ok(None) } else { text.parse().map(Some).map_err(|_| ()) }
}

/// A path as the recipe of another session holds it.
pub(super) fn absolute(from: &Path, value: &str) -> Result<String, SessionError> {
    let path = from.join(value);
    let path: PathBuf = path.canonicalize().map_err(|e| SessionError::reading(&path, e))?;
    path.to_str().map(str::to_string).ok_or(SessionError::PathNotText { path: path.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(name: &str) -> StepKey {
        StepKey::parse(name).unwrap().unwrap_or_else(|| panic!("no key {name}"))
    }

    #[test]
    fn every_key_is_set_shown_and_reset() {
        let plain = StepRecipe { name: "shirt".into(), template: Some("shirt".into()), ..StepRecipe::default() };
        for (name, value) in [
            ("until", "knee"),
            ("sleeve", "short"),
            ("fabric", "denim"),
            ("unit", "mm"),
            ("height", "1.72"),
            ("up", "-z"),
            ("faces", "5000"),
            ("remesh", "quads:20000"),
            ("surface", "scan"),
            ("voxel", "5"),
            ("smoothing-passes", "3"),
            ("reading.smoothing_passes", "3"),
            ("hair", "keep"),
            ("stack.clearance", "0.003"),
            ("pose.missing-limbs", "false"),
        ] {
            let (key, mut step) = (key(name), plain.clone());
            let before = key.text(&step);
            key.set(&mut step, name, value, Path::new(".")).unwrap();
            assert_eq!(key.text(&step), value, "{name}");
            assert_ne!(step, plain, "{name}");
            assert_eq!(StepKey::parse(&key.name()).unwrap(), Some(key), "{name}");
            key.set(&mut step, name, "", Path::new(".")).unwrap();
            assert_eq!((key.text(&step), &step), (before, &plain), "{name}");
        }
    }

    #[test]
    fn unknown_keys_and_wrong_values_are_refused() {
        for name in ["colour", "stitch.length", "mask", "name", ""] {
            assert_eq!(StepKey::parse(name).unwrap(), None, "{name}");
        }
        assert!(StepKey::parse("stack.clearence").unwrap_err().to_string().contains("clearence"));
        let mut step = StepRecipe::default();
        for (name, value) in [
            ("unit", "ell"),
            ("height", "tall"),
            ("up", "sideways"),
            ("faces", "many"),
            ("remesh", "quads:many"),
            ("voxel", "fine"),
            ("surface", "skin"),
            ("path", ""),
        ] {
            let error = key(name).set(&mut step, name, value, Path::new(".")).unwrap_err().to_string();
            assert_eq!(error, format!("{name} cannot be '{value}'"));
        }
        assert!(key("stack.clearance").set(&mut step, "stack.clearance", "wide", Path::new(".")).is_err());
        assert!(key("path").set(&mut step, "path", "not/there.ply", Path::new(".")).is_err());
        assert_eq!(step, StepRecipe::default());
    }
}
