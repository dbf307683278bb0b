//! Pose: fits the figure so far inside the next scan.

use super::fit::{doubts, with_measures};
use super::hair::KnownHair;
use super::kinds::NewGarments;
use crate::body::Figure;
use crate::fit::{FittedBody, InsideParams, PoseInside, RegisteredBody, fit_inside};
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::pipeline::memo::at::{Code, Run};
use crate::session::pipeline::memo::event::{OnProgress, Outcome, StageProgress};
use crate::session::pipeline::memo::input::ModelInput;
use crate::session::recipe::{StepRecipe, params_of};
use crate::session::stage::Stage;
use crate::session::store::{Kept, Store, Warning};
use serde::Serialize;

pub(in crate::session::pipeline) const POSE: Code = Code::new(Stage::Pose, 10);

#[derive(Serialize)]
pub(in crate::session::pipeline) struct Inputs {
    pub scan: Kept<Scan>,
    pub figure: Kept<Figure>,
    /// The pose that the fit starts from.
    pub start: StepPose,
    pub model: ModelInput,
    #[serde(flatten)]
    pub garments: NewGarments,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hair: Option<Kept<FittedBody>>,
    pub params: InsideParams,
}

/// The artefact that holds the pose of a step.
#[derive(Clone, Copy, Serialize)]
#[serde(untagged)]
pub(in crate::session) enum StepPose {
    /// That of the body's step.
    Naked(Kept<RegisteredBody>),
    /// That of a garment's step.
    Inside(Kept<PoseInside>),
}

pub(in crate::session::pipeline) fn run(
    Inputs { scan, figure, start, model, garments, hair, params }: Inputs,
    store: &Store,
    on_progress: OnProgress,
) -> Run<PoseInside> {
    let (scan, figure) = (store.load(scan)?, model.figure(store, figure)?);
    let model = model.load(store)?;
    let (pose, before) = match start {
        StepPose::Naked(registered) => (store.load(registered)?.pose, None),
        StepPose::Inside(inside) => {
            let before = store.load(inside)?;
            (before.pose.clone(), Some(before))
        }
    };
    let cover = garments.cover(&figure)?;
    let cover = match KnownHair::load(store, hair, &figure)? {
        Some(hair) => hair.over(cover),
        None => cover,
    };
    let inside = fit_inside(&scan, &figure, &pose, &cover, &model.limits, &params, &mut |s| {
        on_progress(StageProgress::Iteration(&scan, s))
    })?;
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
        .map(|name| Warning::new(format!("the scan does not show the {name}, which keeps the previous pose"), remedy))
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

/// How far skin may lie outside the noisy scan and still count as inside, in metres.
pub(in crate::session) fn margin(step: &StepRecipe) -> Result<f64, SessionError> {
    // The body's step has no margin of its own; it is measured like a garment's.
    if step.is_body() {
        return Ok(InsideParams::default().margin);
    }
    Ok(params_of::<InsideParams>(step, Stage::Pose)?.margin)
}
