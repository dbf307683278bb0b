//! Whether what a naked fit found is the body of the scan; if so, with its report.

use super::agreement::{NakedAgreement, unexplained_summary};
use super::bent_arms::buried_hand;
use super::fitted_body::FittedBody;
use super::params::NakedParams;
use super::problem::NakedProblem;
use super::refine::ModelEstimate;
use super::report::NakedReport;
use crate::body::{BodyModel, HumanJoint, JointId};
use crate::fit::correspondence::{parts_from, unseen};
use crate::fit::error::FitError;
use crate::geometry::SurfaceIndex;

/// Accepts the estimate, which `index` holds, or says why it is not the body of the scan.
pub(crate) fn conclude(
    problem: &NakedProblem<'_>,
    found: ModelEstimate,
    index: &SurfaceIndex,
    agreement: NakedAgreement,
    unseen: Vec<JointId>,
    log: Vec<String>,
) -> Result<FittedBody, FitError> {
    let buried = buried_hand(problem, index, &unseen);
    check_is_body(problem.model, problem.params, agreement.residual.0, &agreement, &found, &unseen, buried)?;
    Ok(with_report(problem, found, index, agreement, unseen, log))
}

/// The estimate, which `index` holds, with its report.
pub(super) fn with_report(
    problem: &NakedProblem<'_>,
    found: ModelEstimate,
    index: &SurfaceIndex,
    agreement: NakedAgreement,
    unseen: Vec<JointId>,
    mut log: Vec<String>,
) -> FittedBody {
    let model = problem.model;
    let (residual_mean, residual_p95) = agreement.residual;
    log.extend(unexplained_summary(&agreement, &model.weights, &model.skeleton));
    let unseen_head = unseen_head(problem, index);
    let head_is_seen = unseen_head.is_none();
    log.extend(unseen_head);
    if !found.converged {
        log.push(format!("did not converge in {} iterations: check the result", found.iterations));
    }
    let (surface, skeleton) = model.shaped(&found.shape);
    let report = NakedReport {
        converged: found.converged,
        iterations: found.iterations,
        residual_mean,
        residual_p95,
        confidence: agreement.confidence(),
        explained_share: agreement.explained,
        seen_share: agreement.seen,
        head_is_seen,
        log,
    }
    .with_doubt();
    let ModelEstimate { shape, pose, .. } = found;
    let hair = problem.hair.clone();
    FittedBody { shape, pose, surface, skeleton, unseen, poses_in_others: Vec::new(), deviation: None, hair, report }
}

/// A warning if the scan does not show the head, without which everything else is fitted equally well.
fn unseen_head(problem: &NakedProblem<'_>, index: &SurfaceIndex) -> Option<String> {
    if problem.hair.is_some() {
        return None;
    }
    let (skeleton, weights) = (&problem.model.skeleton, &problem.model.weights);
    let head = parts_from(&[HumanJoint::Head], skeleton, weights);
    let unseen = unseen(index, &head, skeleton, problem.surface);
    (!unseen.is_empty()).then(|| "the scan does not show the head; the head is the model's".into())
}

fn check_is_body(
    model: &BodyModel,
    params: &NakedParams,
    residual: f64,
    agreement: &NakedAgreement,
    found: &ModelEstimate,
    unseen: &[JointId],
    buried: Option<JointId>,
) -> Result<(), FitError> {
    // A scan that shows a body and other things is judged by their shares: an average over both describes neither.
    const MOSTLY_A_BODY: f64 = 0.5;
    if residual > params.refuse_above && !(MOSTLY_A_BODY..params.least_explained).contains(&agreement.explained) {
        return Err(FitError::NotABody { residual_mm: residual * 1e3, limit_mm: params.refuse_above * 1e3 });
    }
    // A child is matched nearly, by a body that no adult has: the model is wrong for it, not the scan.
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
    // If a limb was not found, the unexplained rest of the scan is that limb in a pose that was not tried.
    // Missing limbs left 0.1 % on synthetic people, crossed arms 2 to 2.5 %.
    const LIMB: f64 = 0.015;
    let is_in_another_pose = !params.missing_limbs && 1.0 - agreement.explained > LIMB;
    if let (Some(limb), true) = (unseen.first(), is_in_another_pose) {
        return Err(FitError::LimbNotFound {
            limb: model.skeleton.part_name(*limb),
            what: format!(
                "and {:.0} % of the scan's surface does not match the body",
                (1.0 - agreement.explained) * 100.0
            ),
        });
    }
    if let (Some(hand), false) = (buried, params.missing_limbs) {
        return Err(FitError::LimbNotFound {
            limb: model.skeleton.part_name(hand),
            what: "the fit puts it inside the body".into(),
        });
    }
    if let Some(region) = agreement.missing_region(&model.weights, &model.skeleton) {
        return Err(FitError::HalfABody { region: region.into(), seen_percent: agreement.seen * 100.0 });
    }
    far.map_or(Ok(()), Err)
}
