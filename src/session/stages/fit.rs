//! Fit: the body model to the naked scan.

use super::other_steps;
use super::other_steps::OtherStep;
use super::walk::{Outcome, Told, Walk};
use crate::fit::{self, FitReport, FittedBody, NakedParams, OtherScan, fit_naked, fit_together};
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::recipe::{StepRecipe, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use serde_json::json;

/// What helps where the naked scan lacks a limb.
const FILLED_IN: &str =
    "what this scan lacks the next may show: with `overcoat fit body --shape-from all` it is taken from all of them";

pub(in crate::session) fn fit(
    walk: &mut Walk,
    step: &StepRecipe,
    scan: Kept<Scan>,
    others: &[OtherStep],
) -> Result<Kept<FittedBody>, SessionError> {
    let params: NakedParams = params_of(step, Stage::Fit)?;
    let mut inputs = json!({ "scan": scan.hash, "model": walk.session().body_model_input(), "params": params });
    if !others.is_empty() {
        inputs["others"] = other_steps::input(others);
    }
    walk.stage(&step.name, Stage::Fit, inputs, |session, tell| {
        let (scan, model) = (session.store.load(scan)?, session.body_model()?);
        let mut on_step = |s: &fit::Step| tell(Told::Iteration(&scan, s));
        let failed = |e| SessionError::stage(&step.name, Stage::Fit, e);
        let mut fitted = fit_naked(&scan, &model, &params, &mut on_step).map_err(failed)?;
        if !others.is_empty() {
            let scans = others.iter().map(|other| session.store.load(other.scan)).collect::<Result<Vec<_>, _>>()?;
            let covers = other_steps::covers(others, &fitted.figure(&model));
            let others: Vec<OtherScan> = (others.iter().zip(&scans).zip(covers))
                .map(|((of, scan), cover)| OtherScan { name: &of.name, scan, cover, params: of.params.clone() })
                .collect();
            fitted = fit_together(&scan, &fitted, &others, &model, &params, &mut on_step);
        }
        let (report, unseen) = (fitted.report.clone(), fitted.unseen.clone());
        let scans = 1 + fitted.elsewhere.iter().flatten().count();
        let outcome = with_report(Outcome::of(fitted), &report).measured("confidence", report.confidence);
        let lacks_limbs = !unseen.is_empty() && others.is_empty();
        let outcome = outcome.found(lacks_limbs.then(|| FILLED_IN.into()));
        Ok(if others.is_empty() { outcome } else { outcome.measured("scans_in_shape", scans as f64) })
    })
}

/// A fit's report among the measures.
pub(in crate::session) fn with_report<T>(outcome: Outcome<T>, report: &FitReport) -> Outcome<T> {
    outcome
        .measured("residual_mean_mm", report.residual_mean * 1e3)
        .measured("residual_p95_mm", report.residual_p95 * 1e3)
        .measured("iterations", report.iterations as f64)
        .measured("converged", if report.converged { 1.0 } else { 0.0 })
        .found(report.log.iter().cloned())
}
