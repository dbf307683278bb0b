//! Register: the model's surface onto the naked scan.

use super::fit::with_report;
use super::other_steps;
use super::other_steps::OtherStep;
use super::walk::{Outcome, Told, Walk};
use crate::fit::{FittedBody, Known, RegisterParams, RegisteredBody, SeenElsewhere, Step, register_knowing};
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::recipe::{StepRecipe, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use serde_json::json;

pub(in crate::session) fn register(
    walk: &mut Walk,
    step: &StepRecipe,
    scan: Kept<Scan>,
    fitted: Kept<FittedBody>,
    others: &[OtherStep],
) -> Result<Kept<RegisteredBody>, SessionError> {
    let params: RegisterParams = params_of(step, Stage::Register)?;
    let model = walk.session().body_model_input();
    let mut inputs = json!({ "scan": scan.hash, "fitted": fitted.hash, "model": model, "params": params });
    if !others.is_empty() {
        inputs["others"] = other_steps::input(others);
    }
    walk.stage(&step.name, Stage::Register, inputs, |session, tell| {
        let (scan, model) = (session.store.load(scan)?, session.body_model()?);
        let fitted = session.store.load(fitted)?;
        let scans = others.iter().map(|other| session.store.load(other.scan)).collect::<Result<Vec<_>, _>>()?;
        let covers = other_steps::covers(others, &fitted.figure(&model));
        let elsewhere: Vec<SeenElsewhere> = (scans.iter().zip(&fitted.elsewhere).zip(covers))
            .filter_map(|((scan, pose), cover)| Some(SeenElsewhere { scan, pose: pose.as_ref()?, cover }))
            .collect();
        let known = Known { elsewhere: &elsewhere, ..Known::default() };
        let mut on_step = |s: &Step| tell(Told::Iteration(&scan, s));
        let registered = register_knowing(&scan, &model, &fitted, &known, &params, &mut on_step)
            .map_err(|e| SessionError::stage(&step.name, Stage::Register, e))?;
        let report = registered.report.clone();
        Ok(with_report(Outcome::of(registered), &report))
    })
}
