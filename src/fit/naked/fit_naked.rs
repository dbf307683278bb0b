//! The naked fit: initial poses, refinement, limbs that the scan does not show, judgement.

use super::acceptance::conclude;
use super::agreement::agreement;
use super::bent_arms::{refit_with_bent_arms, uncertain_arms, with_trunk_straight};
use super::coarse_fit::CoarseFit;
use super::fitted_body::FittedBody;
use super::params::NakedParams;
use super::problem::NakedProblem;
use super::refine::ModelEstimate;
use crate::body::{BodyModel, JointId};
use crate::fit::correspondence::{DownsampledModel, ScanSurface, display_name, pose_like_other_side, unseen};
use crate::fit::error::FitError;
use crate::fit::solver::FitIteration;
use crate::geometry::SurfaceIndex;
use crate::scan::Scan;

/// Fits shape and pose to a scan of the naked body, whatever its heading and wherever its arms are.
///
/// **Frame** the result's pose is in the scan's world frame.
///
/// **Guarantees** limbs that the scan does not show are named in the report and take the pose of the other side; the
/// report's confidence is the share of the scan that the body explains times the share of the body that the scan shows.
///
/// **Errors** [`FitError::NotABody`], [`FitError::Unexplained`], [`FitError::LimbNotFound`],
/// [`FitError::HalfABody`] and [`FitError::FarFromModel`] where no start leads to a
/// body that explains the scan.
pub fn fit_naked(
    scan: &Scan,
    model: &BodyModel,
    params: &NakedParams,
    on_step: &mut dyn FnMut(&FitIteration),
) -> Result<FittedBody, FitError> {
    if scan.mesh.face_count() == 0 {
        return Err(FitError::EmptyScan);
    }
    let of_model = || (DownsampledModel::of(model), SurfaceIndex::prepare(&model.template));
    let (surface, (thin, index)) = rayon::join(|| ScanSurface::prepare(scan), of_model);
    let mut problem = NakedProblem::prepare(model, index, &surface, params);
    let mut log = Vec::new();

    let coarse = CoarseFit::prepare(&thin, &surface, params);
    let start = problem.best_start(&coarse, &mut log);
    let mut found = problem.refine(start.pose, start.shape, on_step);
    let mut index = problem.index_at(&found.pose, &found.shape);
    let doubtful = uncertain_arms(&problem, &index);
    if !doubtful.is_empty() {
        found = refit_with_bent_arms(&problem, &coarse, &found, &doubtful, &mut log).unwrap_or(found);
        index = problem.index_at(&found.pose, &found.shape);
    }
    let unseen = unseen(&index, &problem.parts, &model.skeleton, &surface);
    if !unseen.is_empty() {
        found = problem.without(&unseen, found, &mut log, on_step);
        index = problem.index_at(&found.pose, &found.shape);
    }

    let agreement = agreement(&index, &surface);
    conclude(&problem, found, &index, agreement, unseen, log)
}

impl NakedProblem<'_> {
    /// The fit again, with some limbs left out of it.
    fn without(
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
                display_name(&skeleton.names[joint.index()])
            ));
        }
        self.leave_out(unseen);
        // The trunk gave way to the limb that was pulled into it: back to the expected pose, and on from there.
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
