//! The parameters of the stages: collected from the declarations of their `Params`, parsed and checked.
//!
//! A recipe lists only the differences from the defaults, by step and stage: `[step.segment]`, `color = 0.5`.

use super::variants::StepKind;
use crate::cut::CutParams;
use crate::fit::{InsideParams, NakedParams, RegisterParams};
use crate::parameters::{Allowed, Declared, Parameters, Setting};
use crate::rig::{PhysicsParams, RigParams};
use crate::scan::{FusionParams, ScanParams};
use crate::segment::RefineParams;
use crate::session::error::SessionError;
use crate::session::stage::Stage;
use crate::stack::{PressParams, StackParams};
use serde_json::Value;
use std::sync::LazyLock;

/// A parameter of a stage.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its stage.
    pub stage: Stage,
    /// Its name, as in the stage's `Params`.
    pub name: &'static str,
    /// The allowed values.
    pub allowed: Allowed,
    /// Description in one line.
    pub about: &'static str,
    /// The default value.
    default: Value,
    /// The kinds of step that have it.
    of: &'static [StepKind],
}

impl Parameter {
    /// Reads a value as typed.
    pub fn read(&self, text: &str) -> Result<Setting, SessionError> {
        self.allowed.read(text).ok_or_else(|| self.refuse(text))
    }

    /// Its default as text.
    pub fn default(&self) -> String {
        as_text(&self.default)
    }

    fn refuse(&self, value: &str) -> SessionError {
        SessionError::BadRequest {
            what: format!("{} of the stage {} cannot be '{value}'", self.name, self.stage),
            hint: format!("{}: {}, by default {}", self.about, self.allowed, self.default()),
        }
    }
}

/// The `Params` of a stage, and the kinds of step that have them.
struct Declaration {
    stage: Stage,
    of: &'static [StepKind],
    /// What each parameter may be, and the defaults.
    read: fn() -> (Vec<Declared>, Value),
}

const fn params<P: Parameters>(stage: Stage, of: &'static [StepKind]) -> Declaration {
    fn read<P: Parameters>() -> (Vec<Declared>, Value) {
        let defaults = serde_json::to_value(P::default()).expect("parameters are numbers, words and lists");
        (P::declared().to_vec(), defaults)
    }
    Declaration { stage, of, read: read::<P> }
}

const BODY: &[StepKind] = &[StepKind::Body];
const GARMENTS: &[StepKind] = &[StepKind::Garment, StepKind::Hair];
/// Steps that put something onto the figure.
const LAYERS: &[StepKind] = &[StepKind::Garment, StepKind::Hair, StepKind::TryOn];
const EVERY: &[StepKind] = &[StepKind::Body, StepKind::Garment, StepKind::Hair];

const DECLARATIONS: [Declaration; 11] = [
    params::<ScanParams>(Stage::Scan, EVERY),
    params::<FusionParams>(Stage::Scan, EVERY),
    params::<NakedParams>(Stage::Fit, BODY),
    params::<RegisterParams>(Stage::Register, BODY),
    params::<InsideParams>(Stage::Pose, GARMENTS),
    params::<RefineParams>(Stage::Segment, GARMENTS),
    params::<CutParams>(Stage::Cut, GARMENTS),
    params::<RigParams>(Stage::Rig, LAYERS),
    params::<StackParams>(Stage::Stack, LAYERS),
    params::<PhysicsParams>(Stage::Figure, LAYERS),
    params::<PressParams>(Stage::Press, LAYERS),
];

/// All parameters, by stage, in the order of their declarations.
static PARAMETERS: LazyLock<Vec<Parameter>> = LazyLock::new(|| DECLARATIONS.iter().flat_map(of_params).collect());

fn of_params(of: &Declaration) -> Vec<Parameter> {
    let Declaration { stage, of, read } = *of;
    let (declared, defaults) = read();
    let parameter = |Declared { name, allowed, about, .. }: Declared| Parameter {
        stage,
        name,
        allowed,
        about,
        default: defaults[name].clone(),
        of,
    };
    declared.into_iter().map(parameter).collect()
}

/// A JSON value as text: `0.5`, `0.02,0.01`, `smooth`.
pub(in crate::session) fn as_text(value: &Value) -> String {
    match value {
        Value::String(word) => word.clone(),
        Value::Array(values) => values.iter().map(as_text).collect::<Vec<_>>().join(","),
        other => other.to_string(),
    }
}

/// The parameters of a stage.
pub fn parameters_of(stage: Stage) -> impl Iterator<Item = &'static Parameter> {
    PARAMETERS.iter().filter(move |p| p.stage == stage)
}

/// Whether the stage has parameters in a kind of step.
pub(in crate::session) fn has_parameters(kind: StepKind, stage: Stage) -> bool {
    parameters_of(stage).any(|p| p.of.contains(&kind))
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

/// Checks a value that a recipe sets.
pub(in crate::session) fn check(stage: Stage, name: &str, setting: &Setting) -> Result<(), SessionError> {
    let parameter = parameter(stage, name)?;
    match parameter.allowed.allows(setting) {
        true => Ok(()),
        false => Err(parameter.refuse(&setting.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::recipe::{StepRecipe, params_of};

    /// Fields that a step of a recipe sets through keys of their own.
    const SET_OTHERWISE: [&str; 4] = ["unit", "up", "faces", "voxel"];

    #[test]
    fn every_field_of_every_params_is_declared_or_set_otherwise() {
        for Declaration { stage, read, .. } in &DECLARATIONS {
            let (declared, Value::Object(fields)) = read() else { panic!("{stage} has no fields") };
            let declared: Vec<_> = declared.iter().map(|d| d.name).collect();
            assert!(declared.iter().all(|name| fields.contains_key(*name)), "{declared:?}");
            let left = fields.keys().filter(|name| !declared.contains(&name.as_str()));
            let left: Vec<_> = left.filter(|name| !SET_OTHERWISE.contains(&name.as_str())).collect();
            assert!(left.is_empty(), "{stage}: {left:?}");
        }
    }

    #[test]
    fn every_default_is_allowed_and_comes_back_from_its_text() {
        for parameter in PARAMETERS.iter() {
            let Parameter { stage, name, .. } = parameter;
            let read = parameter.read(&parameter.default()).unwrap();
            assert_eq!(as_text(&serde_json::json!(read)), parameter.default(), "{stage} {name}");
            assert!(stage.section().is_some(), "{stage} has parameters but no section in a recipe");
        }
    }

    #[test]
    fn the_body_alone_has_no_physics_weights() {
        let has = |kind, stage| has_parameters(kind, stage);
        assert!(has(StepKind::Garment, Stage::Figure) && !has(StepKind::Body, Stage::Figure));
        assert!(has(StepKind::Body, Stage::Scan) && has(StepKind::Garment, Stage::Scan));
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
