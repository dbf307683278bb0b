//! Register: the model's surface onto the naked scan.

use super::recipe::StepRecipe;
use super::state::Stage;
use super::store::Kept;
use super::walk::Walk;
use super::{SessionError, StageError};
use crate::fit::{FittedBody, RegisteredBody};
use crate::scan::Scan;
use serde_json::json;

pub(super) fn register(
    walk: &mut Walk,
    step: &StepRecipe,
    scan: Kept<Scan>,
    fitted: Kept<FittedBody>,
) -> Result<Kept<RegisteredBody>, SessionError> {
    let model = walk.session().body_model_input();
    let inputs = json!({ "scan": scan.hash, "fitted": fitted.hash, "model": model });
    walk.stage(&step.name, Stage::Register, inputs, |_session, _tell| {
        Err(SessionError::stage(&step.name, Stage::Register, StageError::NotAvailable))
    })
}
