//! Fit: the body model to the naked scan.

use super::event::{OnProgress, Outcome, StageProgress};
use super::hair::HAIR_AREA;
use super::later_scans::{self, later_scans};
use super::pipeline_stage::{LaterScan, PipelineStage, StepContext};
use super::scan::ScanStage;
use crate::fit::{self, FittedBody, NakedParams, OtherScan, fit_naked, fit_together};
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{StepRecipe, params_of};
use crate::session::stage::Stage;
use crate::session::store::{Kept, Warning};
use serde_json::{Value, json};
use std::rc::Rc;

/// Advice for a naked scan without a limb.
const USE_ALL_SCANS: &str =
    "scan again with the limb, or let a later scan that shows it add it: `overcoat fit body --shape-from all`";

pub(in crate::session) struct FitStage;

pub(in crate::session) struct Inputs {
    scan: Kept<Scan>,
    later: Rc<[LaterScan]>,
    params: NakedParams,
}

impl PipelineStage for FitStage {
    const STAGE: Stage = Stage::Fit;
    const VERSION: u32 = 9;
    type Inputs = Inputs;
    type Output = FittedBody;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        let params: NakedParams = params_of(context.step, Stage::Fit)?;
        let scan = context.results.result::<ScanStage>()?;
        let later = later_scans(context)?;
        let model = context.walk.session().body_model_input();
        let mut values = json!({ "scan": scan.hash, "model": model, "params": params });
        if !later.is_empty() {
            values["others"] = later_scans::input(&later);
        }
        Ok((Inputs { scan, later, params }, values))
    }

    fn run(
        Inputs { scan, later, params }: Inputs,
        step: &StepRecipe,
        session: &Session,
        on_progress: OnProgress,
    ) -> Result<Outcome<FittedBody>, SessionError> {
        let (scan, model) = (session.store.load(scan)?, session.body_model()?);
        let mut on_step = |s: &fit::FitIteration| on_progress(StageProgress::Iteration(&scan, s));
        let failed = |e| SessionError::stage(&step.name, Stage::Fit, e);
        let mut fitted = fit_naked(&scan, &model, &params, &mut on_step).map_err(failed)?;
        if !later.is_empty() {
            let scans = later.iter().map(|other| session.store.load(other.scan)).collect::<Result<Vec<_>, _>>()?;
            let covers = later_scans::covers(&later, &fitted.figure(&model))?;
            let others: Vec<OtherScan> = (later.iter().zip(&scans).zip(covers))
                .map(|((of, scan), cover)| OtherScan { name: &of.name, scan, cover, params: of.params.clone() })
                .collect();
            fitted = fit_together(&scan, &fitted, &others, &model, &params, &mut on_step).map_err(failed)?;
        }
        let (report, unseen) = (fitted.report.clone(), fitted.unseen.clone());
        let hair = fitted.hair.as_ref().map_or(0.0, |hair| 1e4 * hair.area);
        let scans = 1 + fitted.poses_in_others.iter().flatten().count();
        let distances = (report.residual_mean, report.residual_p95);
        let outcome = with_measures(Outcome::of(fitted), distances, report.iterations, report.converged, &report.log)
            .measured("confidence", report.confidence);
        let outcome = if hair > 0.0 { outcome.measured(HAIR_AREA, hair) } else { outcome };
        let outcome =
            outcome.warned(doubts(report.converged, report.iterations, report.confidence, report.is_confident()));
        let lacking = unseen.iter().filter(|_| later.is_empty()).map(|&limb| {
            let name = model.skeleton.part_name(limb);
            Warning::new(format!("the scan does not show the {name}, which comes from the model"), USE_ALL_SCANS)
        });
        let head = (!report.head_is_seen).then(|| {
            Warning::new("the scan does not show the head, which comes from the model", "scan again with the head")
        });
        let outcome = outcome.warned(lacking).warned(head);
        Ok(if later.is_empty() { outcome } else { outcome.measured("scans_in_shape", scans as f64) })
    }
}

/// What is in doubt about a fit.
pub(super) fn doubts(converged: bool, iterations: usize, confidence: f64, is_confident: bool) -> Vec<Warning> {
    let remedy = "compare body and scan in `view --sheet`, above all hands and feet; scan again if they differ";
    let unfinished = || Warning::new(format!("the fit did not converge in {iterations} iterations"), remedy);
    let low = || Warning::new(format!("scan and figure agree badly, confidence {confidence:.2} of 1"), remedy);
    match (converged, is_confident) {
        (false, _) => vec![unfinished()],
        (true, false) => vec![low()],
        (true, true) => Vec::new(),
    }
}

/// Adds the measures common to all fits; distances are the mean and the 95th percentile, in metres.
pub(super) fn with_measures<T>(
    outcome: Outcome<T>,
    (mean, p95): (f64, f64),
    iterations: usize,
    converged: bool,
    log: &[String],
) -> Outcome<T> {
    outcome
        .measured("residual_mean_mm", mean * 1e3)
        .measured("residual_p95_mm", p95 * 1e3)
        .measured("iterations", iterations as f64)
        .measured("converged", if converged { 1.0 } else { 0.0 })
        .found(log.iter().cloned())
}
