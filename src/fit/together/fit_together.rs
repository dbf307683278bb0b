//! One shape from all scans, and whether the naked scan supports it.

use super::clothed_view::ClothedView;
use super::other_scan::OtherScan;
use crate::body::{BodyModel, Figure, Pose};
use crate::fit::correspondence::ScanSurface;
use crate::fit::error::{FitError, require_length};
use crate::fit::inside::{FigureSurface, fit_inside};
use crate::fit::naked::{
    FINEST, FittedBody, ModelEstimate, NakedMethod, NakedParams, NakedProblem, NakedReport, STILL, agreement, conclude,
};
use crate::fit::solver::{DAMPING, FitIteration, Posed, Singular, StoppingRule, iterate, solve_together};
use crate::geometry::{SurfaceIndex, TriMesh};
use crate::scan::Scan;

/// Greatest number of iterations: poses and shape are nearly right from the start.
const ITERATIONS: usize = 20;

/// Refines the shape of a body fitted to its naked scan with other scans of the same person.
///
/// **Shapes** `others` and the result's `poses_in_others`: one entry per scan.
///
/// **Frame** `poses_in_others` of the result holds poses in each scan's world frame.
///
/// **Guarantees** a scan into which the body cannot be posed is not used, and the report says why. If the others
/// contradict the naked scan, so that the body would fit it worse or would not be accepted, the body keeps its shape, and the
/// report says so.
///
/// **Errors** [`FitError::EmptyScan`], [`FitError::WrongLength`] and [`FitError::OutOfRange`] for arguments that do not fit
/// together; [`FitError::Contradiction`] for [`NakedMethod::Paper`], whose shape the naked scan alone determines.
pub fn fit_together(
    scan: &Scan,
    fitted: &FittedBody,
    others: &[OtherScan<'_>],
    model: &BodyModel,
    params: &NakedParams,
    on_step: &mut dyn FnMut(&FitIteration),
) -> Result<FittedBody, FitError> {
    check_arguments(scan, fitted, others, model, params)?;
    let surface = ScanSurface::prepare(&fitted.bare_part(scan));
    let mut naked = NakedProblem::prepare(model, SurfaceIndex::prepare(&model.template), &surface, params);
    naked.leave_out(&fitted.unseen);
    naked.hair = fitted.hair.clone();
    let figure = fitted.figure(model);
    let mut log = fitted.report.log.clone();

    let poses = poses_in_each(&figure, fitted, others, model, &mut log);
    let prepared: Vec<(ScanSurface, FigureSurface)> = others
        .iter()
        .map(|other| Ok((ScanSurface::prepare(other.scan), FigureSurface::prepare(&figure, &other.cover)?)))
        .collect::<Result<_, FitError>>()?;
    let mut views: Vec<ClothedView> = (others.iter().zip(&prepared).zip(&poses).enumerate())
        .filter_map(|(place, ((other, prepared), pose))| {
            Some(ClothedView::new(place, &figure, model, other, prepared, &fitted.pose, pose.clone()?))
        })
        .collect();
    if views.is_empty() {
        log.push("no other scan takes part in the shape".into());
        return Ok(FittedBody { poses_in_others: poses, report: with_log(fitted, log), ..fitted.clone() });
    }

    let before = fitted.report.residual_mean;
    let mut found = ModelEstimate { iterations: fitted.report.iterations, ..ModelEstimate::at(fitted) };
    refine_together(&naked, &mut views, &mut found, params, on_step);
    let index = naked.index_at(&found.pose, &found.shape);
    let agreement = agreement(&index, naked.surface);
    let after = agreement.residual.0;
    let scans = views.len() + 1;
    let summary = format!("one shape from {scans} scans: {}", change(&fitted.surface, &model.shaped(&found.shape).0));
    let refined_log = log.iter().cloned().chain([summary]).collect();
    let refined = conclude(&naked, found, &index, agreement, fitted.unseen.clone(), refined_log);
    /// The others may worsen the fit to the naked scan by this much, in metres: a tenth of its noise.
    const COST: f64 = 2e-4;
    let contradicted = (after > before + COST).then(|| {
        format!("with all scans the body is {:.1} mm from it on average, alone {:.1} mm", after * 1e3, before * 1e3)
    });
    let why = match (contradicted, refined) {
        (None, Ok(refined)) => {
            let mut poses_in_others = vec![None; others.len()];
            for view in views {
                poses_in_others[view.place] = Some(view.pose);
            }
            return Ok(FittedBody { poses_in_others, ..refined });
        }
        (Some(why), _) => why,
        (None, Err(error)) => error.to_string(),
    };
    log.push(format!("the other scans contradict the naked one: {why}; the body keeps its shape"));
    Ok(FittedBody { report: with_log(fitted, log), ..fitted.clone() })
}

fn check_arguments(
    scan: &Scan,
    fitted: &FittedBody,
    others: &[OtherScan<'_>],
    model: &BodyModel,
    params: &NakedParams,
) -> Result<(), FitError> {
    params.check()?;
    if params.method == NakedMethod::Paper {
        return Err(FitError::Contradiction { first: "method paper", second: "a shape from several scans" });
    }
    let vertices = model.template.vertex_count();
    require_length("vertices of the fitted body, per vertex of the model", fitted.surface.vertex_count(), vertices)?;
    require_length("rotations of the fitted pose, per joint", fitted.pose.rotations.len(), model.skeleton.len())?;
    require_length("shape coefficients, per component", fitted.shape.0.len(), model.component_count())?;
    for other in others {
        require_length("cover in another scan, per vertex of the body", other.cover.len(), vertices)?;
        other.params.check()?;
    }
    if scan.mesh.face_count() == 0 { Err(FitError::EmptyScan) } else { Ok(()) }
}

fn with_log(fitted: &FittedBody, log: Vec<String>) -> NakedReport {
    NakedReport { log, ..fitted.report.clone() }
}

/// The body's pose in each of the scans, each fitted from the pose in the previous one.
fn poses_in_each(
    figure: &Figure,
    fitted: &FittedBody,
    others: &[OtherScan<'_>],
    model: &BodyModel,
    log: &mut Vec<String>,
) -> Vec<Option<Pose>> {
    let mut last = fitted.pose.clone();
    let mut pose_in = |other: &OtherScan<'_>| match fit_inside(
        other.scan,
        figure,
        &last,
        &other.cover,
        &model.limits,
        &other.params,
        &mut |_| {},
    ) {
        Ok(inside) => {
            last = inside.pose.clone();
            Some(inside.pose)
        }
        Err(error) => {
            log.push(format!("the scan '{}' is not used for the shape: {error}", other.name));
            None
        }
    };
    others.iter().map(&mut pose_in).collect()
}

/// One sentence on how far a surface moved.
fn change(before: &TriMesh, after: &TriMesh) -> String {
    let areas = before.vertex_areas();
    let moves = || before.points().iter().zip(after.points().iter()).map(|(p, q)| (p - q).norm());
    let mean = moves().zip(areas.iter()).map(|(d, a)| d * a).sum::<f64>() / areas.iter().sum::<f64>().max(1e-12);
    let most = moves().fold(0.0, f64::max);
    format!("the body changed by {:.1} mm on average, {:.1} mm at most", mean * 1e3, most * 1e3)
}

/// Gauss–Newton steps until no joint of the naked scan moves.
fn refine_together(
    naked: &NakedProblem,
    views: &mut [ClothedView],
    found: &mut ModelEstimate,
    params: &NakedParams,
    on_step: &mut dyn FnMut(&FitIteration),
) {
    let places = naked.places(params.samples);
    let mut index = naked.index.clone();
    let rule = StoppingRule { steps: ITERATIONS, still: STILL, still_steps: 2, first_still: 0 };
    let settled = iterate(&rule, |_| {
        let posed = naked.body.posed(&found.pose, &found.shape);
        index.follow(&naked.mesh(&posed));
        let (mut equations, residual) = naked.equations(&FINEST, &places, &posed, &found.pose, &index);
        equations.freeze_all_but(&naked.unknowns(true));
        let mut parts = vec![equations];
        let seen: Vec<Posed> = views.iter_mut().map(|view| view.posed(&found.shape)).collect();
        parts.extend(views.iter().zip(&seen).map(|(view, posed)| view.equations(posed)));
        let steps = solve_together(&parts, &found.shape, params.shape_prior, DAMPING)?;

        let (pose, shape) = naked.body.stepped(&posed, &found.pose, &found.shape, &steps[0]);
        for ((view, posed), step) in views.iter_mut().zip(&seen).zip(&steps[1..]) {
            view.pose = view.problem.body.stepped(posed, &view.pose, &found.shape, step).0;
        }
        // Limbs that cloth hides may move in their scans without any effect on the shape.
        let moved = naked.moved(&posed, &pose, &shape);
        (found.pose, found.shape) = (pose, shape);
        found.iterations += 1;
        on_step(&FitIteration { iteration: found.iterations, moved, residual, surface: index.mesh() });
        Ok::<_, Singular>(moved)
    });
    found.converged = settled.converged;
}
