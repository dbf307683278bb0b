//! Parameters of stages: which there are, what they may be, and what a recipe says of them.
//!
//! A stage's `Params` hold the defaults. A recipe names only what differs from them, step by step and stage by stage:
//! `[step.segment]`, `color = 0.5`.

use super::setting::{Allowed, Parameter, Setting};
use crate::fit::{InsideParams, NakedParams, RegisterParams};
use crate::scan::{FusionParams, ScanParams};
use crate::session::error::SessionError;
use crate::session::stage::Stage;
use serde::Serialize;
use serde_json::Value;

impl Parameter {
    /// Reads a value as typed.
    pub fn read(&self, text: &str) -> Result<Setting, SessionError> {
        self.allowed.read(text).ok_or_else(|| self.refuse(text))
    }

    /// What the stage does where nothing is said; empty for a parameter that no stage has.
    pub fn default(&self) -> String {
        defaults(self.stage).get(self.name).map(shown).unwrap_or_default()
    }

    fn refuse(&self, value: &str) -> SessionError {
        SessionError::BadRequest {
            what: format!("{} of the stage {} cannot be '{value}'", self.name, self.stage),
            hint: format!("{}: {}, by default {}", self.about, self.allowed, self.default()),
        }
    }
}

/// A JSON value for people: `0.5`, `0.02,0.01`, `smooth`.
pub(in crate::session) fn shown(value: &Value) -> String {
    match value {
        Value::String(word) => word.clone(),
        Value::Array(values) => values.iter().map(shown).collect::<Vec<_>>().join(","),
        other => other.to_string(),
    }
}

/// The parameters of a stage.
pub fn parameters_of(stage: Stage) -> impl Iterator<Item = &'static Parameter> {
    super::parameter_table::PARAMETERS.iter().filter(move |p| p.stage == stage)
}

/// The parameter of that name.
pub(in crate::session) fn parameter(stage: Stage, name: &str) -> Result<&'static Parameter, SessionError> {
    parameters_of(stage).find(|p| p.name == name).ok_or_else(|| SessionError::BadRequest {
        what: format!("the stage {stage} has no parameter '{name}'"),
        hint: match parameters_of(stage).map(|p| p.name).collect::<Vec<_>>() {
            names if names.is_empty() => "it has none that can be set".into(),
            names => format!("it has {}", names.join(", ")),
        },
    })
}

/// Whether what a recipe says of a parameter can be; else the error.
pub(in crate::session) fn check(stage: Stage, name: &str, setting: &Setting) -> Result<(), SessionError> {
    let parameter = parameter(stage, name)?;
    match parameter.allowed.allows(setting) {
        true => Ok(()),
        false => Err(parameter.refuse(&setting.to_string())),
    }
}

/// What a recipe says, as the stage's own type is written: a whole number may stand where a number is meant.
pub(super) fn as_json(stage: Stage, name: &str, setting: &Setting) -> Value {
    let allowed = parameters_of(stage).find(|p| p.name == name).map(|p| p.allowed);
    match (allowed, setting) {
        (Some(Allowed::Real(..)), Setting::Count(n)) => Value::from(*n as f64),
        (_, setting) => serde_json::json!(setting),
    }
}

/// The defaults of a stage by name; `Null` for a stage without parameters.
pub(in crate::session) fn defaults(stage: Stage) -> Value {
    fn of<P: Default + Serialize>() -> Value {
        serde_json::to_value(P::default()).unwrap_or_default()
    }
    match stage {
        Stage::Scan => defaults_of_scan(),
        Stage::Fit => of::<NakedParams>(),
        Stage::Register => of::<RegisterParams>(),
        Stage::Pose => of::<InsideParams>(),
        Stage::Segment => of::<crate::segment::RefineParams>(),
        Stage::Cut => of::<crate::cut::CutParams>(),
        Stage::Rig => of::<crate::rig::RigParams>(),
        Stage::Stack => of::<crate::stack::StackParams>(),
        Stage::Figure => of::<crate::rig::PhysicsParams>(),
        Stage::Press => of::<crate::stack::PressParams>(),
        Stage::Evidence => Value::Null,
    }
}

/// The defaults of both by name, but for what a step has keys of its own for.
fn defaults_of_scan() -> Value {
    let mut all = serde_json::Map::new();
    for params in [serde_json::to_value(ScanParams::default()), serde_json::to_value(FusionParams::default())] {
        if let Ok(Value::Object(fields)) = params {
            all.extend(fields);
        }
    }
    for own in ["unit", "up", "faces", "voxel"] {
        all.remove(own);
    }
    Value::Object(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::recipe::parameter_table::PARAMETERS;
    use crate::session::recipe::{StepRecipe, params_of};
    use crate::stack::StackParams;

    #[test]
    fn every_field_of_every_params_is_in_the_table_and_its_default_is_allowed() {
        for &stage in Stage::ALL.iter().filter(|stage| stage.section().is_some()) {
            let Value::Object(fields) = defaults(stage) else { panic!("{stage} has no parameters") };
            for (name, value) in &fields {
                let known = parameters_of(stage).find(|p| p.name == name);
                let known = known.unwrap_or_else(|| panic!("add {name} of {stage} to session/parameter_table.rs"));
                let read = known.read(&shown(value)).unwrap();
                assert_eq!(as_json(stage, name, &read), *value, "{stage} {name}");
            }
            for parameter in parameters_of(stage) {
                assert!(fields.contains_key(parameter.name), "{stage} has no {}", parameter.name);
            }
        }
        assert!(PARAMETERS.iter().all(|p| p.stage.section().is_some()));
    }

    #[test]
    fn a_recipe_goes_over_the_defaults_and_only_there() {
        let mut step = StepRecipe { name: "shirt".into(), ..StepRecipe::default() };
        assert_eq!(params_of::<StackParams>(&step, Stage::Stack).unwrap(), StackParams::default());
        step.stack.insert("clearance".into(), Setting::Count(0));
        step.stack.insert("smoothing_lengths".into(), Setting::Reals(vec![0.01, 0.004]));
        let params = params_of::<StackParams>(&step, Stage::Stack).unwrap();
        let expected = StackParams { clearance: 0.0, smoothing_lengths: vec![0.01, 0.004], ..StackParams::default() };
        assert_eq!(params, expected);
    }

    #[test]
    fn what_cannot_be_is_refused() {
        for (stage, name, text) in [
            (Stage::Stack, "clearance", "-0.001"),
            (Stage::Stack, "clearance", "NaN"),
            (Stage::Stack, "clearance", "wide"),
            (Stage::Stack, "method", "pull"),
            (Stage::Stack, "smoothing_lengths", "0.01,,0.02"),
            (Stage::Fit, "samples", "0"),
            (Stage::Fit, "samples", "1e9"),
            (Stage::Pose, "missing_limbs", "maybe"),
        ] {
            assert!(parameter(stage, name).unwrap().read(text).is_err(), "{stage} {name} {text}");
        }
        assert!(parameter(Stage::Stack, "clearence").is_err());
    }
}
