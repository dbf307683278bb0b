//! Pose: fits the figure so far inside the next scan.

use super::event::{OnProgress, Outcome, StageProgress};
use super::fit::{doubts, with_measures};
use super::hair::KnownHair;
use super::kinds::NewGarments;
use super::pipeline_stage::{PipelineStage, StepContext, StepPose};
use super::scan::ScanStage;
use crate::body::Figure;
use crate::fit::{FittedBody, InsideParams, PoseInside, fit_inside};
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{StepRecipe, params_of};
use crate::session::stage::Stage;
use crate::session::store::{Kept, Warning};
use serde_json::{Value, json};

pub(in crate::session) struct PoseStage;

pub(in crate::session) struct Inputs {
    scan: Kept<Scan>,
    figure: Kept<Figure>,
    initial: StepPose,
    garments: NewGarments,
    hair: Option<Kept<FittedBody>>,
    params: InsideParams,
}

impl PipelineStage for PoseStage {
    const STAGE: Stage = Stage::Pose;
    const VERSION: u32 = 9;
    type Inputs = Inputs;
    type Output = PoseInside;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        let params: InsideParams = params_of(context.step, Stage::Pose)?;
        let garments = NewGarments::of(&context.walk.session().recipe, context.step)?;
        let inner = context.before_scan()?;
        let (scan, figure, initial) = (context.results.result::<ScanStage>()?, inner.figure()?, inner.pose()?);
        let values = json!({
            "scan": scan.hash,
            "figure": figure.hash,
            "start": initial.hash(),
            "model": context.walk.session().body_model_input(),
            "params": params,
        });
        let mut values = garments.among(values, context.step.outfit.is_some());
        let hair = context.fit_with_hair()?;
        if let Some(fitted) = hair {
            values["hair"] = json!(fitted.hash);
        }
        Ok((Inputs { scan, figure, initial, garments, hair, params }, values))
    }

    fn run(
        Inputs { scan, figure, initial, garments, hair, params }: Inputs,
        step: &StepRecipe,
        session: &Session,
        on_progress: OnProgress,
    ) -> Result<Outcome<PoseInside>, SessionError> {
        let (scan, figure) = (session.store.load(scan)?, session.figure(figure)?);
        let model = session.body_model()?;
        let (pose, before) = match initial {
            StepPose::Naked(registered) => (session.store.load(registered)?.pose, None),
            StepPose::Inside(inside) => {
                let before = session.store.load(inside)?;
                (before.pose.clone(), Some(before))
            }
        };
        let cover = garments.cover(&figure, &step.name)?;
        let cover = match KnownHair::load(session, hair, &figure)? {
            Some(hair) => hair.over(cover),
            None => cover,
        };
        let inside = fit_inside(&scan, &figure, &pose, &cover, &model.limits, &params, &mut |s| {
            on_progress(StageProgress::Iteration(&scan, s))
        })
        .map_err(|e| SessionError::stage(&step.name, Stage::Pose, e))?;
        let inside = match before {
            None => inside,
            Some(before) => inside.offset_inward_as(&before),
        };
        let report = inside.report.clone();
        let deepest = inside.offsets.iter().fold(0.0_f64, |most, d| most.max(d.abs()));
        let distances = (report.residual_mean, report.residual_p95);
        let remedy = "scan again with the whole person if the limb has moved";
        let unseen: Vec<Warning> = (report.unseen.iter().map(|&limb| figure.skeleton.part_name(limb)))
            .chain((!report.head_is_seen).then(|| "head".to_string()))
            .map(|name| {
                Warning::new(format!("the scan does not show the {name}, which keeps the previous pose"), remedy)
            })
            .collect();
        Ok(with_measures(Outcome::of(inside), distances, report.iterations, report.converged, &report.log)
            .measured("confidence", report.confidence)
            .measured("joint_change_mm", report.joint_change * 1e3)
            .measured("proximity_mm", report.proximity * 1e3)
            .measured("outside_percent", report.outside_share * 100.0)
            .measured("outside_depth_mm", report.outside_depth * 1e3)
            .measured("greatest_offset_mm", deepest * 1e3)
            .warned(unseen)
            .warned(doubts(report.converged, report.iterations, report.confidence, report.is_confident())))
    }
}

/// How far skin may lie outside the noisy scan and still count as inside, in metres.
pub(in crate::session) fn margin(step: &StepRecipe) -> Result<f64, SessionError> {
    // The body's step has no margin of its own; it is measured like a garment's.
    if step.is_body() {
        return Ok(InsideParams::default().margin);
    }
    Ok(params_of::<InsideParams>(step, Stage::Pose)?.margin)
}
