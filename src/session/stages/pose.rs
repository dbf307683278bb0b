//! Pose: the figure dressed so far, inside the next scan.

use super::dressed::{Dressed, StepPose};
use super::fit::with_report;
use super::walk::{Outcome, Told, Walk};
use crate::body::Pose;
use crate::fit::{InsideParams, PoseInside, fit_inside};
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{StepRecipe, garment_kind, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use serde_json::json;

pub(in crate::session) fn pose(
    walk: &mut Walk,
    step: &StepRecipe,
    scan: Kept<Scan>,
    inner: &Dressed,
) -> Result<Kept<PoseInside>, SessionError> {
    let params: InsideParams = params_of(step, Stage::Pose)?;
    let kind = garment_kind::of_step(step)?;
    let inputs = json!({
        "scan": scan.hash,
        "figure": inner.figure.hash,
        "start": inner.pose.hash(),
        "kind": kind.input(),
        "model": walk.session().body_model_input(),
        "params": params,
    });
    walk.stage(&step.name, Stage::Pose, inputs, |session, tell| {
        let (scan, figure) = (session.store.load(scan)?, session.figure(inner.figure)?);
        let (start, model) = (pose_of(session, &inner.pose)?, session.body_model()?);
        let cover = kind.template.cover(figure.body(), &figure.skeleton, &kind.extent);
        let inside = fit_inside(&scan, &figure, &start, &cover, &model.limits, &params, &mut |s| {
            tell(Told::Iteration(&scan, s))
        })
        .map_err(|e| SessionError::stage(&step.name, Stage::Pose, e))?;
        let inside = match inner.pose {
            StepPose::Naked { .. } => inside,
            StepPose::Inside { inside: before, .. } => inside.drawn_in_as(&session.store.load(before)?),
        };
        let report = inside.report.clone();
        let deepest = inside.offsets.iter().fold(0.0_f64, |most, d| most.max(d.abs()));
        Ok(with_report(Outcome::of(inside), &report)
            .measured("confidence", report.confidence)
            .measured("joint_change_mm", report.joint_change * 1e3)
            .measured("proximity_mm", report.proximity * 1e3)
            .measured("outside_percent", report.outside_share * 100.0)
            .measured("outside_depth_mm", report.outside_depth * 1e3)
            .measured("greatest_offset_mm", deepest * 1e3))
    })
}

/// The pose of a step that is built.
fn pose_of(session: &Session, pose: &StepPose) -> Result<Pose, SessionError> {
    Ok(match pose {
        StepPose::Naked { registered, .. } => session.store.load(*registered)?.pose,
        StepPose::Inside { inside, .. } => session.store.load(*inside)?.pose,
    })
}

/// How far skin may lie outside the noisy scan and still count as inside, in metres.
pub(in crate::session) fn margin(step: &StepRecipe) -> Result<f64, SessionError> {
    // The body's step has none of its own; what it measures is judged like a garment's.
    if step.is_body() {
        return Ok(InsideParams::default().margin);
    }
    Ok(params_of::<InsideParams>(step, Stage::Pose)?.margin)
}
