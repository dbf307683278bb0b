//! The figure dressed so far, posed inside the next scan: Hu 2017, Eqs. 5–6.
//!
//! Eq. 5 is the articulated ICP of the naked fit over what the scan should show of the figure. Eq. 6 is held as a
//! constraint: each Gauss–Newton step is a quadratic program with a row `n·(q − v) ≥ margin` for each body vertex that
//! cloth hides, and an exact L1 slack so that a scan smaller than the figure is an answer and not a failure.

use super::cover::Cover;
use super::figure_surface::FigureSurface;
use super::offset::bounded_offsets;
use super::params::{InsideMethod, InsideParams};
use super::pose_inside::PoseInside;
use super::problem::InsideProblem;
use super::unseen_limbs::{joint_change, with_limbs_of};
use super::violation::ConstraintViolation;
use crate::body::{Figure, JointLimits, Pose};
use crate::fit::correspondence::ScanSurface;
use crate::fit::error::FitError;
use crate::fit::report::FitReport;
use crate::fit::solver::FitIteration;
use crate::geometry::PerVertex;
use crate::scan::Scan;

/// Poses the figure inside the scan.
///
/// **Frame** `start` is any pose, usually the previous step's; the result's is in this scan's world frame.
///
/// **Guarantees** every hidden body vertex that the scan saw is inside by the margin after pose and offset, unless
/// the report's log says how much of that is lacking, and `outside_share` what lies outside altogether. Limbs that the scan
/// does not show are named in the report and keep the pose of `start`.
///
/// **Errors** [`FitError::NotThisPerson`] where what should show is not there, [`FitError::LimbNotFound`] where a limb is
/// elsewhere, [`FitError::Outside`] where the scan is far too small, [`FitError::Unexplained`] where it shows more than the
/// figure.
pub fn fit_inside(
    scan: &Scan,
    figure: &Figure,
    start: &Pose,
    cover: &PerVertex<Cover>,
    limits: &[JointLimits],
    params: &InsideParams,
    on_step: &mut dyn FnMut(&FitIteration),
) -> Result<PoseInside, FitError> {
    if scan.mesh.face_count() == 0 {
        return Err(FitError::EmptyScan);
    }
    let (surface, figure_surface) =
        rayon::join(|| ScanSurface::prepare(scan), || FigureSurface::prepare(figure, cover));
    let mut problem = InsideProblem::new(figure, &figure_surface, &surface, limits, params);
    let mut log = Vec::new();

    let previous = start;
    let start = problem.best_start(start, &mut log);
    let mut found = problem.refine(start.clone(), previous, on_step, &mut log);
    let unseen = problem.unseen_limbs(previous, &found.pose);
    if !unseen.is_empty() {
        problem.leave_out(&unseen, &mut log);
        found = problem.refine(with_limbs_of(start, previous, &figure.skeleton, &unseen), previous, on_step, &mut log);
    }

    let posed = problem.posed(&found.pose);
    let (residual_mean, residual_p95) = problem.visible_distances(&posed);
    let body_mesh = problem.body_mesh(&posed);
    let required = problem.required_offsets(&posed, &body_mesh);
    let offsets = if params.constrained && params.method == InsideMethod::Robust {
        let along_normals = required.iter().map(|required| required.map(|r| r.along_normal)).collect();
        bounded_offsets(&body_mesh, &along_normals, params.greatest_offset)
    } else {
        PerVertex::filled(0.0, figure_surface.body_count)
    };
    let violation =
        ConstraintViolation::of(&problem.hidden_areas(&body_mesh), &required, &offsets, |v| problem.full_margin(v));
    let agreement = problem.agreement(&posed);
    problem.check_same_person(residual_mean, &violation, &agreement, &unseen, &posed)?;
    log.extend(violation.summary(&figure.skeleton, &figure.body().weights));
    log.extend(agreement.summary());
    log.extend(problem.unseen_head(&posed).map(String::from));
    if !found.converged {
        log.push(format!("not converged after {} iterations: look at the result", found.iterations));
    }
    let moved = offsets.iter().filter(|o| **o < 0.0).count();
    log.push(format!("{moved} of {} body vertices are drawn in by the bounded offset", figure_surface.body_count));
    let report = FitReport {
        converged: found.converged,
        iterations: found.iterations,
        residual_mean,
        residual_p95,
        outside_share: violation.outside_share,
        outside_depth: violation.outside_depth,
        joint_change: joint_change(&figure.skeleton, previous, &found.pose),
        proximity: problem.proximity(previous, &found.pose, &offsets),
        confidence: agreement.explained * agreement.seen * (1.0 - violation.outside_share),
        explained_share: agreement.explained,
        seen_share: agreement.seen,
        log,
    }
    .doubted();
    Ok(PoseInside { pose: found.pose, offsets, report })
}
