//! Register: the model's surface onto the naked scan.

use super::event::{OnProgress, Outcome, StageProgress};
use super::fit::{FitStage, with_measures};
use super::later_scans::{self, later_scans};
use super::pipeline_stage::{LaterScan, PipelineStage, StepContext};
use super::scan::ScanStage;
use crate::fit::{
    FillInView, FitIteration, FittedBody, RegisterHints, RegisterParams, RegisteredBody, register_with_hints,
};
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{StepRecipe, params_of};
use crate::session::stage::Stage;
use crate::session::store::{Kept, Warning};
use serde_json::{Value, json};
use std::rc::Rc;

pub(in crate::session) struct RegisterStage;

pub(in crate::session) struct Inputs {
    scan: Kept<Scan>,
    fitted: Kept<FittedBody>,
    later: Rc<[LaterScan]>,
    params: RegisterParams,
}

impl PipelineStage for RegisterStage {
    const STAGE: Stage = Stage::Register;
    const VERSION: u32 = 4;
    type Inputs = Inputs;
    type Output = RegisteredBody;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        let params: RegisterParams = params_of(context.step, Stage::Register)?;
        let (scan, fitted) = (context.results.result::<ScanStage>()?, context.results.result::<FitStage>()?);
        let later = later_scans(context)?;
        let model = context.walk.session().body_model_input();
        let mut values = json!({ "scan": scan.hash, "fitted": fitted.hash, "model": model, "params": params });
        if !later.is_empty() {
            values["others"] = later_scans::input(&later);
        }
        Ok((Inputs { scan, fitted, later, params }, values))
    }

    fn run(
        Inputs { scan, fitted, later, params }: Inputs,
        step: &StepRecipe,
        session: &Session,
        on_progress: OnProgress,
    ) -> Result<Outcome<RegisteredBody>, SessionError> {
        let (scan, model) = (session.store.load(scan)?, session.body_model()?);
        let fitted = session.store.load(fitted)?;
        let scans = later.iter().map(|other| session.store.load(other.scan)).collect::<Result<Vec<_>, _>>()?;
        let covers = later_scans::covers(&later, &fitted.figure(&model))?;
        let fill_in: Vec<FillInView> = (scans.iter().zip(&fitted.poses_in_others).zip(covers))
            .filter_map(|((scan, pose), cover)| Some(FillInView { scan, pose: pose.as_ref()?, cover }))
            .collect();
        let hints = RegisterHints { fill_in: &fill_in, ..RegisterHints::default() };
        let mut on_step = |s: &FitIteration| on_progress(StageProgress::Iteration(&scan, s));
        let registered = register_with_hints(&scan, &model, &fitted, &hints, &params, &mut on_step)
            .map_err(|e| SessionError::stage(&step.name, Stage::Register, e))?;
        let report = registered.report.clone();
        let distances = (report.residual_mean, report.residual_p95);
        let outcome =
            with_measures(Outcome::of(registered), distances, report.iterations, report.converged, &report.log);
        Ok(outcome.warned((!report.converged).then(|| {
            Warning::new(
                format!(
                    "the registration still moved the surface by {:.2} mm in its last iteration",
                    1e3 * report.last_move
                ),
                "compare body and scan in `view --sheet`",
            )
        })))
    }
}
