//! Whether what a naked fit found is the body of the scan; if so, with its report.

use super::agreement::{Agreement, unexplained_summary};
use super::bent_arms::buried_hand;
use super::fitted_body::FittedBody;
use super::params::NakedParams;
use super::problem::NakedProblem;
use super::refine::ModelEstimate;
use crate::body::{BodyModel, JointId};
use crate::fit::correspondence::{display_name, parts_named, unseen};
use crate::fit::error::FitError;
use crate::fit::report::FitReport;
use crate::geometry::SurfaceIndex;

/// What was found, which `index` holds, with its report, or why it is no body.
pub(crate) fn conclude(
    problem: &NakedProblem<'_>,
    found: ModelEstimate,
    index: &SurfaceIndex,
    agreement: Agreement,
    unseen: Vec<JointId>,
    mut log: Vec<String>,
) -> Result<FittedBody, FitError> {
    let model = problem.model;
    let (residual_mean, residual_p95) = agreement.residual;
    let buried = buried_hand(problem, index, &unseen);
    check_is_body(model, problem.params, residual_mean, &agreement, &found, &unseen, buried)?;
    log.extend(unexplained_summary(&agreement, &model.weights, &model.skeleton));
    log.extend(unseen_head(problem, index));
    if !found.converged {
        log.push(format!("not converged after {} iterations: look at the result", found.iterations));
    }
    let (surface, skeleton) = model.shaped(&found.shape);
    let report = FitReport {
        converged: found.converged,
        iterations: found.iterations,
        residual_mean,
        residual_p95,
        confidence: agreement.confidence(),
        explained_share: agreement.explained,
        seen_share: agreement.seen,
        log,
        ..FitReport::default()
    }
    .doubted();
    let ModelEstimate { shape, pose, .. } = found;
    Ok(FittedBody { shape, pose, surface, skeleton, unseen, poses_in_others: Vec::new(), report })
}

/// A sentence where the scan lacks the head, without which all the rest is fitted as well.
fn unseen_head(problem: &NakedProblem<'_>, index: &SurfaceIndex) -> Option<String> {
    let (skeleton, weights) = (&problem.model.skeleton, &problem.model.weights);
    let head = parts_named(&["head"], skeleton, weights);
    let unseen = unseen(index, &head, skeleton, problem.surface);
    (!unseen.is_empty()).then(|| "the scan does not show the head; it is the model's".into())
}

fn check_is_body(
    model: &BodyModel,
    params: &NakedParams,
    residual: f64,
    agreement: &Agreement,
    found: &ModelEstimate,
    unseen: &[JointId],
    buried: Option<&str>,
) -> Result<(), FitError> {
    // What shows a body besides other things is told of by their share: an average over both says nothing of either.
    const MOSTLY_A_BODY: f64 = 0.5;
    if residual > params.refuse_above && !(MOSTLY_A_BODY..params.least_explained).contains(&agreement.explained) {
        return Err(FitError::NotABody { residual_mm: residual * 1e3, limit_mm: params.refuse_above * 1e3 });
    }
    // A child is fitted nearly, by a body that is none: what is wrong is the model, not the scan.
    const NEARLY: f64 = 0.85;
    let deviation = found.shape.0.iter().fold(0.0_f64, |most, beta| most.max(beta.abs()));
    let far = (deviation > params.greatest_deviation)
        .then_some(FitError::FarFromModel { deviation, limit: params.greatest_deviation });
    if let (Some(far), true) = (&far, agreement.explained > NEARLY) {
        return Err(far.clone());
    }
    if agreement.explained < params.least_explained {
        let near = agreement.least_explained_part(&model.weights, &model.skeleton);
        return Err(FitError::Unexplained {
            percent: (1.0 - agreement.explained) * 100.0,
            limit_percent: (1.0 - params.least_explained) * 100.0,
            near: near.unwrap_or_else(|| "body".into()),
        });
    }
    // What is left of the scan where a limb was not found is that limb, in a pose that was not.
    // Missing limbs left 0.1 % on invented people, crossed arms 2 to 2.5 %.
    const LIMB: f64 = 0.015;
    let is_in_another_pose = !params.missing_limbs && 1.0 - agreement.explained > LIMB;
    if let (Some(limb), true) = (unseen.first(), is_in_another_pose) {
        return Err(FitError::LimbNotFound {
            limb: display_name(&model.skeleton.names[limb.index()]),
            what: format!(
                "and {:.0} % of the scan's surface is no part of the body",
                (1.0 - agreement.explained) * 100.0
            ),
        });
    }
    if let (Some(hand), false) = (buried, params.missing_limbs) {
        return Err(FitError::LimbNotFound { limb: display_name(hand), what: "inside the body".into() });
    }
    if let Some(region) = agreement.missing_region(&model.weights, &model.skeleton) {
        return Err(FitError::HalfABody { region: region.into(), seen_percent: agreement.seen * 100.0 });
    }
    far.map_or(Ok(()), Err)
}
