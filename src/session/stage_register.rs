//! Register: the model's surface onto the naked scan.

use super::SessionError;
use super::parameters::params_of;
use super::recipe::StepRecipe;
use super::stage_fit::with_report;
use super::state::Stage;
use super::store::Kept;
use super::walk::{Outcome, Told, Walk};
use crate::fit::{FittedBody, RegisterParams, RegisteredBody, register as register_body};
use crate::scan::Scan;
use serde_json::json;

pub(super) fn register(
    walk: &mut Walk,
    step: &StepRecipe,
    scan: Kept<Scan>,
    fitted: Kept<FittedBody>,
) -> Result<Kept<RegisteredBody>, SessionError> {
    let params: RegisterParams = params_of(step, Stage::Register)?;
    let model = walk.session().body_model_input();
    let inputs = json!({ "scan": scan.hash, "fitted": fitted.hash, "model": model, "params": params });
    walk.stage(&step.name, Stage::Register, inputs, |session, tell| {
        let (scan, model) = (session.store.load(scan)?, session.body_model()?);
        let fitted = session.store.load(fitted)?;
        let registered = register_body(&scan, &model, &fitted, &params, &mut |s| tell(Told::Iteration(&scan, s)))
            .map_err(|e| SessionError::stage(&step.name, Stage::Register, e))?;
        let report = registered.report.clone();
        Ok(with_report(Outcome::of(registered), &report))
    })
}
