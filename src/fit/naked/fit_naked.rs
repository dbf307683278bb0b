//! The naked fit: initial poses, refinement, limbs that the scan does not show, acceptance.

use super::acceptance::{conclude, with_report};
use super::agreement::agreement;
use super::bent_arms::{refit_with_bent_arms, uncertain_arms, with_trunk_straight};
use super::coarse_fit::CoarseFit;
use super::find_hair::find_hair;
use super::fitted_body::FittedBody;
use super::hair::Hair;
use super::paper::fit_eq_4;
use super::params::{HairTreatment, NakedMethod, NakedParams};
use super::problem::NakedProblem;
use super::refine::ModelEstimate;
use crate::body::{BodyModel, JointId};
use crate::fit::correspondence::{DownsampledModel, ScanSurface, pose_like_other_side, unseen};
use crate::fit::error::FitError;
use crate::fit::hands::Hands;
use crate::fit::solver::FitIteration;
use crate::geometry::SurfaceIndex;
use crate::scan::Scan;

/// Fits shape and pose to a scan of the naked body, whatever its heading and the pose of its arms.
///
/// **Frame** the result's pose is in the scan's world frame.
///
/// **Guarantees** limbs that the scan does not show are named in the report and take the pose of the other side.
///
/// **Errors** [`FitError::EmptyScan`] and [`FitError::OutOfRange`] for arguments that cannot be fitted;
/// [`FitError::NotABody`], [`FitError::Unexplained`], [`FitError::LimbNotFound`], [`FitError::HalfABody`] and
/// [`FitError::FarFromModel`] if no initial pose leads to a body that explains the scan. [`NakedMethod::Paper`] returns
/// none of the latter.
pub fn fit_naked(
    scan: &Scan,
    model: &BodyModel,
    params: &NakedParams,
    on_step: &mut dyn FnMut(&FitIteration),
) -> Result<FittedBody, FitError> {
    params.check()?;
    if scan.mesh.face_count() == 0 {
        return Err(FitError::EmptyScan);
    }
    match params.method {
        NakedMethod::Robust => fit_robust(scan, model, params, on_step),
        NakedMethod::Paper => Ok(fit_paper(scan, model, params, on_step)),
    }
}

fn fit_paper(
    scan: &Scan,
    model: &BodyModel,
    params: &NakedParams,
    on_step: &mut dyn FnMut(&FitIteration),
) -> FittedBody {
    let surface = ScanSurface::prepare(scan);
    let problem = NakedProblem::prepare(model, SurfaceIndex::prepare(&model.template), &surface, params);
    let found = fit_eq_4(&problem, params, on_step);
    let index = problem.index_at(&found.pose, &found.shape);
    let agreement = agreement(&index, &surface);
    with_report(&problem, found, &index, agreement, Vec::new(), Vec::new())
}

fn fit_robust(
    scan: &Scan,
    model: &BodyModel,
    params: &NakedParams,
    on_step: &mut dyn FnMut(&FitIteration),
) -> Result<FittedBody, FitError> {
    let of_model = || (DownsampledModel::of(model), SurfaceIndex::prepare(&model.template));
    let (surface, (downsampled, index)) = rayon::join(|| ScanSurface::prepare(scan), of_model);
    let downsampled = downsampled?;
    let mut problem = NakedProblem::prepare(model, index, &surface, params);
    let mut log = Vec::new();

    let coarse = CoarseFit::prepare(&downsampled, &surface, params);
    let initial = problem.best_initial_pose(&coarse, &mut log);
    let mut found = problem.refine(initial.pose, initial.shape, on_step);
    let mut index = problem.index_at(&found.pose, &found.shape);
    let uncertain = uncertain_arms(&problem, &index);
    if !uncertain.is_empty() {
        found = refit_with_bent_arms(&problem, &coarse, &found, &uncertain, &mut log).unwrap_or(found);
        index = problem.index_at(&found.pose, &found.shape);
    }
    let unseen = unseen(&index, &problem.parts, &model.skeleton, &surface);
    if !unseen.is_empty() {
        found = problem.refine_without(&unseen, found, &mut log, on_step);
        index = problem.index_at(&found.pose, &found.shape);
    }

    problem.fit_hands(&mut found, &mut index, &unseen, &mut log, on_step);
    let agreement = agreement(&index, &surface);
    // What is not found of a limb may be at the head: then nothing is hair.
    let may_be_hair = unseen.is_empty() && params.hair != HairTreatment::Keep;
    let with_hair = conclude(&problem, found.clone(), &index, agreement, unseen, log.clone());
    let is_wanted = params.hair == HairTreatment::Drop || matches!(with_hair, Err(FitError::Unexplained { .. }));
    if !(may_be_hair && is_wanted) {
        return with_hair;
    }
    match find_hair(scan, &mut problem, &found) {
        Some(found) => fit_without_hair(scan, model, params, &surface, found, log, on_step),
        None => with_hair,
    }
}

/// Fits the rest of the scan, from the head that is predicted below the hair.
fn fit_without_hair(
    scan: &Scan,
    model: &BodyModel,
    params: &NakedParams,
    with_hair: &ScanSurface,
    (mut hair, predicted): (Hair, ModelEstimate),
    mut log: Vec<String>,
    on_step: &mut dyn FnMut(&FitIteration),
) -> Result<FittedBody, FitError> {
    let bare = hair.removed_from(scan);
    if bare.mesh.face_count() == 0 {
        return Err(FitError::EmptyScan);
    }
    let surface = ScanSurface::prepare(&bare);
    let mut problem = NakedProblem::prepare(model, SurfaceIndex::prepare(&model.template), &surface, params);
    log.push(format!("hair: {:.0} cm², not part of the body; head from the model there", 1e4 * hair.area));
    let mut found = problem.refine(predicted.pose, predicted.shape, on_step);
    let mut index = problem.index_at(&found.pose, &found.shape);
    problem.fit_hands(&mut found, &mut index, &[], &mut log, on_step);
    hair.cover(index.mesh(), &with_hair.index);
    problem.hair = Some(hair);
    let agreement = agreement(&index, &surface);
    conclude(&problem, found, &index, agreement, Vec::new(), log)
}

impl NakedProblem<'_> {
    /// Fits the grasps of the hands, and refines the body with them: fingers in another grasp have pulled at the arms.
    fn fit_hands(
        &self,
        found: &mut ModelEstimate,
        index: &mut SurfaceIndex,
        unseen: &[JointId],
        log: &mut Vec<String>,
        on_step: &mut dyn FnMut(&FitIteration),
    ) {
        let (mesh, skeleton) = self.model.shaped(&found.shape);
        let hands = Hands {
            mesh: &mesh,
            weights: &self.model.weights,
            skeleton: &skeleton,
            is_bare: &|_| true,
            turns_wrists: true,
        };
        let said = hands.fit(self.surface, &mut found.pose, unseen);
        if !said.is_empty() {
            log.extend(said);
            *found = self.refine(found.pose.clone(), found.shape.clone(), on_step);
            *index = self.index_at(&found.pose, &found.shape);
        }
    }

    /// Refines again without the limbs that the scan does not show.
    fn refine_without(
        &mut self,
        unseen: &[JointId],
        found: ModelEstimate,
        log: &mut Vec<String>,
        on_step: &mut dyn FnMut(&FitIteration),
    ) -> ModelEstimate {
        let skeleton = &self.model.skeleton;
        for &joint in unseen {
            log.push(format!(
                "the scan does not show the {}; it takes the pose of the other side",
                skeleton.part_name(joint)
            ));
        }
        self.leave_out(unseen);
        // The trunk has yielded to the limb that was pulled into it: reset it to the expected pose.
        let mut pose = with_trunk_straight(self, &found.pose);
        for &joint in unseen {
            pose_like_other_side(&mut pose, skeleton, joint, unseen);
        }
        let mut found = self.refine(pose, found.shape, on_step);
        for &joint in unseen {
            pose_like_other_side(&mut found.pose, skeleton, joint, unseen);
        }
        found
    }
}
