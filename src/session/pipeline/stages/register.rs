//! Register: the model's surface onto the naked scan.

use super::fit::with_measures;
use super::later_scans::{self, LaterScan, contacts_in_each};
use crate::fit::{
    FillInView, FitIteration, FittedBody, RegisterHints, RegisterParams, RegisteredBody, places_inside,
    register_with_hints, visible_skin,
};
use crate::scan::Scan;
use crate::session::pipeline::memo::at::{Code, Run};
use crate::session::pipeline::memo::event::{OnProgress, Outcome, StageProgress};
use crate::session::pipeline::memo::input::ModelInput;
use crate::session::stage::Stage;
use crate::session::store::{Kept, Store, Warning};
use serde::Serialize;

pub(in crate::session::pipeline) const REGISTER: Code = Code::new(Stage::Register, 4);

#[derive(Serialize)]
pub(in crate::session::pipeline) struct Inputs {
    pub scan: Kept<Scan>,
    pub fitted: Kept<FittedBody>,
    pub model: ModelInput,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub others: Vec<LaterScan>,
    /// Whether `scan` is the first of the others, and shows clothes.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub is_estimated: bool,
    pub params: RegisterParams,
}

pub(in crate::session::pipeline) fn run(
    Inputs { scan, fitted, model, mut others, is_estimated, params }: Inputs,
    store: &Store,
    on_progress: OnProgress,
) -> Run<RegisteredBody> {
    let (mut scan, model) = (store.load(scan)?, model.load(store)?);
    let fitted = store.load(fitted)?;
    let mut landmarks = Vec::new();
    if is_estimated {
        let contact = contacts_in_each(&others[..1], &model)?.swap_remove(0);
        landmarks = places_inside(&scan, &model, &fitted, &contact);
        scan = visible_skin(&scan, &model, &fitted, &contact)?;
        others.remove(0);
    }
    let scans = others.iter().map(|other| store.load(other.scan)).collect::<Result<Vec<_>, _>>()?;
    let covers = later_scans::covers(&others, &fitted.figure(&model))?;
    let fill_in: Vec<FillInView> = (scans.iter().zip(&fitted.poses_in_others).zip(covers))
        .filter_map(|((scan, pose), cover)| Some(FillInView { scan, pose: pose.as_ref()?, cover }))
        .collect();
    let hints = RegisterHints { landmarks: &landmarks, fill_in: &fill_in };
    let mut on_step = |s: &FitIteration| on_progress(StageProgress::Iteration(&scan, s));
    let registered = register_with_hints(&scan, &model, &fitted, &hints, &params, &mut on_step)?;
    let report = registered.report.clone();
    let distances = (report.residual_mean, report.residual_p95);
    let outcome = with_measures(Outcome::of(registered), distances, report.iterations, report.converged, &report.log);
    Ok(outcome.warned((!report.converged).then(|| {
        let moved = 1e3 * report.last_move;
        Warning::new(
            format!("the registration still moved the surface by {moved:.2} mm in its last iteration"),
            "compare body and scan in `view --sheet`",
        )
    })))
}
