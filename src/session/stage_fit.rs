//! Fit: the body model to the naked scan.

use super::SessionError;
use super::parameters::params_of;
use super::recipe::StepRecipe;
use super::state::Stage;
use super::store::Kept;
use super::walk::{Outcome, Told, Walk};
use crate::fit::{FitReport, FittedBody, NakedParams, fit_naked};
use crate::scan::Scan;
use serde_json::json;

pub(super) fn fit(walk: &mut Walk, step: &StepRecipe, scan: Kept<Scan>) -> Result<Kept<FittedBody>, SessionError> {
    let params: NakedParams = params_of(step, Stage::Fit)?;
    let inputs = json!({ "scan": scan.hash, "model": walk.session().body_model_input(), "params": params });
    walk.stage(&step.name, Stage::Fit, inputs, |session, tell| {
        let (scan, model) = (session.store.load(scan)?, session.body_model()?);
        let fitted = fit_naked(&scan, &model, &params, &mut |s| tell(Told::Iteration(&scan, s)))
            .map_err(|e| SessionError::stage(&step.name, Stage::Fit, e))?;
        let report = fitted.report.clone();
        Ok(with_report(Outcome::of(fitted), &report).measured("confidence", report.confidence))
    })
}

/// A fit's report among the measures.
pub(super) fn with_report<T>(outcome: Outcome<T>, report: &FitReport) -> Outcome<T> {
    outcome
        .measured("residual_mean_mm", report.residual_mean * 1e3)
        .measured("residual_p95_mm", report.residual_p95 * 1e3)
        .measured("iterations", report.iterations as f64)
        .measured("converged", if report.converged { 1.0 } else { 0.0 })
        .found(report.log.iter().cloned())
}
