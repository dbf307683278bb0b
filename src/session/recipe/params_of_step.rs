//! A stage's `Params` for a step: the defaults, overridden by the recipe.

use super::overridden::overridden;
use super::steps::StepRecipe;
use crate::session::error::SessionError;
use crate::session::stage::Stage;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The `Params` of a stage of a step: the defaults, overridden by the recipe.
pub(in crate::session) fn params_of<P: Serialize + DeserializeOwned + Default>(
    step: &StepRecipe,
    stage: Stage,
) -> Result<P, SessionError> {
    params_over(P::default(), step, stage)
}

/// A stage's `Params` for a step: the given defaults, overridden by the recipe. Settings of fields that `P` does not
/// have belong to another `Params` of the stage.
pub(in crate::session) fn params_over<P: Serialize + DeserializeOwned>(
    defaults: P,
    step: &StepRecipe,
    stage: Stage,
) -> Result<P, SessionError> {
    let unfit = |e: serde_json::Error| SessionError::BadRequest {
        what: format!("the parameters of the stage {stage} of '{}' do not fit it: {e}", step.name),
        hint: "take them out of the recipe".into(),
    };
    overridden(defaults, step.settings(stage)).map_err(unfit)
}
