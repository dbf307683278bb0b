//! Parameters of stages: which there are, what they may be, and what a recipe says of them.
//!
//! A stage's `Params` hold the defaults. A recipe names only what differs from them, step by step and stage by stage:
//! `[step.segment]`, `color = 0.5`.

use super::SessionError;
use super::recipe::StepRecipe;
use super::state::Stage;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt;

/// A value as a recipe has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Setting {
    /// Yes or no.
    Flag(bool),
    /// A whole number.
    Count(u64),
    /// A number.
    Real(f64),
    /// Numbers.
    Reals(Vec<f64>),
    /// One of some words.
    Word(String),
}

/// What a step's recipe says of the parameters of one stage, by name.
pub type Settings = BTreeMap<String, Setting>;

/// What a parameter may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Allowed {
    /// Yes or no.
    Flag,
    /// A whole number from the first to the second.
    Count(u64, u64),
    /// A number from the first to the second.
    Real(f64, f64),
    /// One to sixteen numbers from the first to the second.
    Reals(f64, f64),
    /// One of these.
    Word(&'static [&'static str]),
}

/// A parameter of a stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Its stage.
    pub stage: Stage,
    /// Its name, as in the stage's `Params`.
    pub name: &'static str,
    /// What it may be. Bounds keep out what no person or garment needs and what would take hours or divide by zero.
    pub allowed: Allowed,
    /// What it does, in a line.
    pub about: &'static str,
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flag(flag) => write!(f, "{flag}"),
            Self::Count(count) => write!(f, "{count}"),
            Self::Real(real) => write!(f, "{real}"),
            Self::Reals(reals) => f.write_str(&reals.iter().map(f64::to_string).collect::<Vec<_>>().join(",")),
            Self::Word(word) => f.write_str(word),
        }
    }
}

impl fmt::Display for Allowed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flag => f.write_str("true or false"),
            Self::Count(least, most) => write!(f, "a whole number from {least} to {most}"),
            Self::Real(least, most) => write!(f, "a number from {least} to {most}"),
            Self::Reals(least, most) => write!(f, "numbers from {least} to {most}, with commas between"),
            Self::Word(words) => f.write_str(&words.join(" or ")),
        }
    }
}

impl Allowed {
    fn allows(&self, setting: &Setting) -> bool {
        let within = |x: f64, least: f64, most: f64| (least..=most).contains(&x);
        match (*self, setting) {
            (Self::Flag, Setting::Flag(_)) => true,
            (Self::Count(least, most), Setting::Count(n)) => (least..=most).contains(n),
            (Self::Real(least, most), Setting::Real(x)) => within(*x, least, most),
            (Self::Real(least, most), Setting::Count(n)) => within(*n as f64, least, most),
            (Self::Reals(least, most), Setting::Reals(xs)) => {
                (1..=16).contains(&xs.len()) && xs.iter().all(|&x| within(x, least, most))
            }
            (Self::Word(words), Setting::Word(word)) => words.contains(&word.as_str()),
            _ => false,
        }
    }

    /// Reads what a person typed.
    fn read(&self, text: &str) -> Option<Setting> {
        let setting = match self {
            Self::Flag => Setting::Flag(text.parse().ok()?),
            Self::Count(..) => Setting::Count(text.parse().ok()?),
            Self::Real(..) => Setting::Real(text.parse().ok()?),
            Self::Reals(..) => {
                Setting::Reals(text.split(',').map(|x| x.trim().parse().ok()).collect::<Option<Vec<f64>>>()?)
            }
            Self::Word(_) => Setting::Word(text.into()),
        };
        self.allows(&setting).then_some(setting)
    }
}

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
pub(super) fn shown(value: &Value) -> String {
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
pub(super) fn parameter(stage: Stage, name: &str) -> Result<&'static Parameter, SessionError> {
    parameters_of(stage).find(|p| p.name == name).ok_or_else(|| SessionError::BadRequest {
        what: format!("the stage {stage} has no parameter '{name}'"),
        hint: match parameters_of(stage).map(|p| p.name).collect::<Vec<_>>() {
            names if names.is_empty() => "it has none that can be set".into(),
            names => format!("it has {}", names.join(", ")),
        },
    })
}

/// Whether what a recipe says of a parameter can be; else the error.
pub(super) fn check(stage: Stage, name: &str, setting: &Setting) -> Result<(), SessionError> {
    let parameter = parameter(stage, name)?;
    match parameter.allowed.allows(setting) {
        true => Ok(()),
        false => Err(parameter.refuse(&setting.to_string())),
    }
}

/// The `Params` of a stage of a step: the defaults, and over them what the recipe says.
pub(super) fn params_of<P: Serialize + DeserializeOwned + Default>(
    step: &StepRecipe,
    stage: Stage,
) -> Result<P, SessionError> {
    params_over(P::default(), step, stage)
}

/// The same over other defaults. What the recipe says of fields that they do not have is for another type of the stage.
pub(super) fn params_over<P: Serialize + DeserializeOwned>(
    defaults: P,
    step: &StepRecipe,
    stage: Stage,
) -> Result<P, SessionError> {
    let unfit = |e: serde_json::Error| SessionError::BadRequest {
        what: format!("the parameters of the stage {stage} of '{}' do not fit it: {e}", step.name),
        hint: "take them out of the recipe".into(),
    };
    let settings = step.settings(stage);
    if settings.is_empty() {
        return Ok(defaults);
    }
    let mut value = serde_json::to_value(defaults).map_err(unfit)?;
    if let Value::Object(fields) = &mut value {
        for (name, setting) in settings.iter().filter(|(name, _)| fields.contains_key(*name)).collect::<Vec<_>>() {
            fields.insert(name.clone(), as_json(stage, name, setting));
        }
    }
    serde_json::from_value(value).map_err(unfit)
}

/// What a recipe says, as the stage's own type is written: a whole number may stand where a number is meant.
fn as_json(stage: Stage, name: &str, setting: &Setting) -> Value {
    let allowed = parameters_of(stage).find(|p| p.name == name).map(|p| p.allowed);
    match (allowed, setting) {
        (Some(Allowed::Real(..)), Setting::Count(n)) => Value::from(*n as f64),
        (_, setting) => serde_json::json!(setting),
    }
}

/// The defaults of a stage by name; `Null` for a stage without parameters.
pub(super) fn defaults(stage: Stage) -> Value {
    fn of<P: Default + Serialize>() -> Value {
        serde_json::to_value(P::default()).unwrap_or_default()
    }
    match stage {
        Stage::Scan => super::stage_scan::defaults(),
        Stage::Fit => of::<crate::fit::NakedParams>(),
        Stage::Register => of::<crate::fit::RegisterParams>(),
        Stage::Pose => of::<crate::fit::InsideParams>(),
        Stage::Segment => of::<crate::segment::RefineParams>(),
        Stage::Cut => of::<crate::cut::CutParams>(),
        Stage::Rig => of::<crate::rig::RigParams>(),
        Stage::Stack => of::<crate::stack::StackParams>(),
        Stage::Figure => of::<crate::rig::PhysicsParams>(),
        Stage::Press => of::<crate::stack::PressParams>(),
        Stage::Evidence => Value::Null,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::parameter_table::PARAMETERS;
    use crate::session::sections::WITH_SETTINGS;
    use crate::stack::StackParams;

    #[test]
    fn every_field_of_every_params_is_in_the_table_and_its_default_is_allowed() {
        for stage in WITH_SETTINGS {
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
        assert!(PARAMETERS.iter().all(|p| WITH_SETTINGS.contains(&p.stage)));
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
            (Stage::Pose, "constrained", "maybe"),
        ] {
            assert!(parameter(stage, name).unwrap().read(text).is_err(), "{stage} {name} {text}");
        }
        assert!(parameter(Stage::Stack, "clearence").is_err());
    }
}
