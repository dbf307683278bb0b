//! The fit inside a scan: initial pose, refinement, limbs that the scan does not show, offset, acceptance.
//!
//! Eq. 5 is the articulated ICP of the naked fit over what the scan should show of the figure. Eq. 6 is a constraint of each
//! Gauss–Newton step, a quadratic program with one row `n·(q − v) ≥ margin` per body vertex that cloth hides. An exact L1
//! slack makes a scan that is smaller than the figure a result and not a failure.

use super::cover::Cover;
use super::figure_surface::FigureSurface;
use super::offset::bounded_offsets;
use super::paper::fit_eqs_5_and_6;
use super::params::{InsideMethod, InsideParams};
use super::pose_inside::PoseInside;
use super::problem::InsideProblem;
use super::refine::PoseEstimate;
use super::report::InsideReport;
use super::unseen_limbs::{joint_change, with_limbs_of};
use super::violation::ConstraintViolation;
use crate::body::{Figure, JointId, JointLimits, Pose};
use crate::fit::correspondence::ScanSurface;
use crate::fit::error::{FitError, require_length};
use crate::fit::hands::Hands;
use crate::fit::solver::FitIteration;
use crate::geometry::{PerVertex, VertexId};
use crate::scan::Scan;

/// Poses the figure inside the scan.
///
/// **Shapes** `cover` has one entry per vertex of the body; `start` one rotation per joint; `limits` one entry per joint, or
/// none at all.
///
/// **Frame** `start` is any pose, usually the previous step's; the result's is in this scan's world frame.
///
/// **Guarantees** every hidden body vertex that the scan shows is inside by the margin after pose and offset, unless
/// the report's log states the violation; `outside_share` is what remains outside the scan. Limbs that the scan does not
/// show are named in the report and keep the pose of `start`.
///
/// **Errors** [`FitError::EmptyScan`], [`FitError::WrongLength`] and [`FitError::OutOfRange`] for arguments that do not fit
/// together; [`FitError::NotThisPerson`] if the scan does not show what should be visible, [`FitError::LimbNotFound`] for a
/// limb in another pose, [`FitError::Outside`] if the scan is far too small, [`FitError::Unexplained`] if it shows more than
/// the figure. [`InsideMethod::Paper`] returns none of the latter.
pub fn fit_inside(
    scan: &Scan,
    figure: &Figure,
    start: &Pose,
    cover: &PerVertex<Cover>,
    limits: &[JointLimits],
    params: &InsideParams,
    on_step: &mut dyn FnMut(&FitIteration),
) -> Result<PoseInside, FitError> {
    check_arguments(figure, start, cover, limits, params)?;
    if scan.mesh.face_count() == 0 {
        return Err(FitError::EmptyScan);
    }
    let (surface, figure_surface) =
        rayon::join(|| ScanSurface::prepare(scan), || FigureSurface::prepare(figure, cover));
    let figure_surface = figure_surface?;
    let mut problem = InsideProblem::new(figure, &figure_surface, &surface, limits, params);
    let mut log = Vec::new();
    let (mut found, unseen) = match params.method {
        InsideMethod::Paper => (fit_eqs_5_and_6(&problem, start, on_step, &mut log), Vec::new()),
        _ => problem.refine_visible(start, on_step, &mut log),
    };

    if params.method != InsideMethod::Paper {
        log.extend(problem.fit_hands(figure, &mut found.pose, &unseen));
    }
    let posed = problem.posed(&found.pose);
    let (residual_mean, residual_p95) = problem.visible_distances(&posed);
    let body_mesh = problem.body_mesh(&posed);
    let required = problem.required_offsets(&posed, &body_mesh);
    let offsets = if params.method.has_offset() {
        let along_normals = required.iter().map(|required| required.map(|r| r.along_normal)).collect();
        bounded_offsets(&body_mesh, &along_normals, params.greatest_offset)
    } else {
        PerVertex::filled(0.0, figure_surface.body_count)
    };
    let violation =
        ConstraintViolation::of(&problem.hidden_areas(&body_mesh), &required, &offsets, |v| problem.full_margin(v));
    let agreement = problem.agreement(&posed);
    if params.method != InsideMethod::Paper {
        problem.check_same_person(residual_mean, &violation, &agreement, &unseen, &posed)?;
    }
    log.extend(violation.summary(&figure.skeleton, &figure.body().weights));
    log.extend(agreement.summary());
    let unseen_head = problem.unseen_head(&posed);
    let head_is_seen = unseen_head.is_none();
    log.extend(unseen_head.map(String::from));
    if !found.converged {
        log.push(format!("did not converge in {} iterations: check the result", found.iterations));
    }
    let moved = offsets.iter().filter(|o| **o < 0.0).count();
    log.push(format!("{moved} of {} body vertices are offset inward", figure_surface.body_count));
    let report = InsideReport {
        converged: found.converged,
        iterations: found.iterations,
        residual_mean,
        residual_p95,
        outside_share: violation.outside_share,
        outside_depth: violation.outside_depth,
        joint_change: joint_change(&figure.skeleton, start, &found.pose),
        proximity: problem.proximity(start, &found.pose, &offsets),
        confidence: agreement.explained * agreement.seen * (1.0 - violation.outside_share),
        explained_share: agreement.explained,
        seen_share: agreement.seen,
        unseen,
        head_is_seen,
        log,
    }
    .with_doubt();
    Ok(PoseInside { pose: found.pose, offsets, report })
}

fn check_arguments(
    figure: &Figure,
    start: &Pose,
    cover: &PerVertex<Cover>,
    limits: &[JointLimits],
    params: &InsideParams,
) -> Result<(), FitError> {
    let joints = figure.skeleton.len();
    require_length("cover, per vertex of the body", cover.len(), figure.body().mesh.vertex_count())?;
    require_length("rotations of the start pose, per joint", start.rotations.len(), joints)?;
    if !limits.is_empty() {
        require_length("joint limits, per joint", limits.len(), joints)?;
    }
    for layer in &figure.layers {
        require_length("skin weights, per vertex of the layer", layer.weights.len(), layer.mesh.vertex_count())?;
    }
    params.check()
}

impl InsideProblem<'_> {
    /// Fits the grasps of bare hands.
    fn fit_hands(&self, figure: &Figure, pose: &mut Pose, unseen: &[JointId]) -> Vec<String> {
        let body = figure.body();
        let is_bare = |v: VertexId| !self.figure_surface.must_stay_inside(v);
        let hands = Hands {
            mesh: &body.mesh,
            weights: &body.weights,
            skeleton: &figure.skeleton,
            is_bare: &is_bare,
            turns_wrists: false,
        };
        hands.fit(self.surface, pose, unseen)
    }

    /// Refines the best initial pose, and again without the limbs that the scan does not show, which are returned.
    fn refine_visible(
        &mut self,
        previous: &Pose,
        on_step: &mut dyn FnMut(&FitIteration),
        log: &mut Vec<String>,
    ) -> (PoseEstimate, Vec<JointId>) {
        let initial = self.best_initial_pose(previous, log);
        let found = self.refine(initial.clone(), previous, on_step, log);
        let unseen = self.unseen_limbs(previous, &found.pose);
        if unseen.is_empty() {
            return (found, unseen);
        }
        self.leave_out(&unseen, log);
        let initial = with_limbs_of(initial, previous, &self.body.skeleton, &unseen);
        (self.refine(initial, previous, on_step, log), unseen)
    }
}
