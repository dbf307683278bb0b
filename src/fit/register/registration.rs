//! The registration: rounds of targets and smooth displacements.

use super::bind_pose::into_bind_pose;
use super::colors::{colors_of, flowed_in};
use super::displacement::{greatest_move, mean_distance, rms_move, solve};
use super::fill_in::{FillInView, PreparedView, fill_colors, fill_targets};
use super::ground::Ground;
use super::hair_above::HairAbove;
use super::params::RegisterParams;
use super::registered_body::RegisteredBody;
use super::report::RegistrationReport;
use super::targets::{TargetPoint, target_weights, targets};
use super::texture::bake_texture;
use crate::body::BodyModel;
use crate::fit::correspondence::{ScanSurface, mean_and_p95};
use crate::fit::error::{FitError, require_length, require_range};
use crate::fit::naked::FittedBody;
use crate::fit::solver::{FitIteration, StoppingRule, iterate};
use crate::geometry::{Point, TriMesh, VertexId, self_intersecting_pairs};
use crate::scan::Scan;
use rayon::prelude::*;

/// What is known in addition to the scan.
#[derive(Clone, Copy, Debug, Default)]
pub struct RegisterHints<'a> {
    /// Vertices of the model with their known places in the scan's frame.
    pub landmarks: &'a [(VertexId, Point)],
    /// Other scans of the same person, which show skin that this one does not.
    pub fill_in: &'a [FillInView<'a>],
}

/// Registers the model's surface to the scan and transforms it back into the bind pose.
///
/// **Guarantees** the result has the model's vertices and faces; skinned with its pose it is the registered surface.
///
/// **Errors** those of [`register_with_hints`].
pub fn register(
    scan: &Scan,
    model: &BodyModel,
    fitted: &FittedBody,
    params: &RegisterParams,
    on_step: &mut dyn FnMut(&FitIteration),
) -> Result<RegisteredBody, FitError> {
    register_with_hints(scan, model, fitted, &RegisterHints::default(), params, on_step)
}

/// Registers the model's surface to the scan with landmarks and with other scans of the same person.
///
/// **Guarantees** those of [`register`].
///
/// **Errors** [`FitError::EmptyScan`]; [`FitError::WrongLength`] and [`FitError::OutOfRange`] for arguments that do not belong
/// to the model; [`FitError::Singular`] for a template whose Laplacian cannot be factored.
pub fn register_with_hints(
    scan: &Scan,
    model: &BodyModel,
    fitted: &FittedBody,
    hints: &RegisterHints<'_>,
    params: &RegisterParams,
    on_step: &mut dyn FnMut(&FitIteration),
) -> Result<RegisteredBody, FitError> {
    /// A landmark counts as this many vertices: it must move those around it, within the smoothing length.
    const LANDMARK_WEIGHT: f64 = 30.0;
    check_arguments(scan, model, fitted, hints, params)?;
    let hair = fitted.hair.as_ref().map(|hair| HairAbove::prepare(hair, scan, model));
    let scan = &*fitted.bare_part(scan);
    let surface = ScanSurface::prepare(scan);
    let bare = fitted.figure(model);
    let others: Vec<PreparedView> =
        hints.fill_in.iter().map(|view| PreparedView::prepare(view, &bare)).collect::<Result<_, FitError>>()?;
    let start = fitted.surface.with_points(model.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose));
    let pull = target_weights(model, params);
    let ground = Ground::under(scan, model);
    let mut log = Vec::new();
    let mut hair = hair;
    let mut displaced = start.clone();
    let rounds = params.smoothing_lengths.len();
    let steps = rounds * params.iterations;
    let areas = start.vertex_areas();
    let mut last_move = f64::INFINITY;
    let settled = iterate(&StoppingRule::always(steps), |number| {
        let (round, length) = (number / params.iterations, params.smoothing_lengths[number / params.iterations]);
        let t = if rounds > 1 { round as f64 / (rounds - 1) as f64 } else { 1.0 };
        let reach = params.reach * (1.0 - t * 2.0 / 3.0);
        let mut targets = targets(&surface, &displaced, &ground.is_foot, reach);
        fill_targets(&mut targets, &others, &displaced, model, fitted, reach);
        targets.iter_mut().zip(pull.iter()).for_each(|(target, share)| {
            *target = target.map(|(place, pull)| (place, pull * share));
        });
        ground.hold_soles(&displaced, &mut targets);
        if let Some(hair) = &mut hair {
            hair.hold_below(&displaced, &mut targets);
        }
        hints.landmarks.iter().for_each(|&(v, place)| targets[v.index()] = Some((place, LANDMARK_WEIGHT)));
        let next = solve(&start, &targets, length)?;
        let (moved, residual) = (greatest_move(&displaced, &next), mean_distance(&displaced, &targets));
        on_step(&FitIteration { iteration: number + 1, moved, residual, surface: &displaced });
        last_move = rms_move(&displaced, &next, &areas);
        displaced = next;
        Ok::<_, FitError>(moved)
    });
    if let Some(error) = settled.stopped {
        return Err(error);
    }
    if last_move >= RegistrationReport::CONVERGED_BELOW {
        log.push(format!(
            "did not converge: the last of {} iterations moved the surface by {:.2} mm",
            settled.steps,
            last_move * 1e3
        ));
    }
    let (residual_mean, residual_p95) = residual(&surface, &displaced);
    let colors = scan.colors.as_ref().map(|colors| {
        let mut own = colors_of(&surface, colors, &displaced);
        fill_colors(&mut own, &others, &displaced, model, fitted);
        flowed_in(own, &displaced)
    });
    let uvs = match (&scan.colors, &colors, &model.uvs) {
        (Some(of_scan), Some(of_body), Some(uvs)) => Some(bake_texture(&surface, of_scan, &displaced, of_body, uvs)),
        (_, _, uvs) => uvs.clone(),
    };
    let (points_in_bind, skeleton, pose) = into_bind_pose(model, fitted, displaced.points());
    let mut seen = targets(&surface, &displaced, &ground.is_foot, 0.02);
    let count = |targets: &[TargetPoint]| targets.iter().filter(|t| t.is_some()).count();
    let own = count(&seen);
    fill_targets(&mut seen, &others, &displaced, model, fitted, 0.02);
    let fill_in = match count(&seen) - own {
        0 => String::new(),
        more => format!(", {more} more on other scans"),
    };
    log.push(format!("{own} of {} vertices are on the scan{fill_in}", model.template.vertex_count()));
    log.push(soundness(&start, &displaced));
    let report = RegistrationReport {
        converged: last_move < RegistrationReport::CONVERGED_BELOW,
        iterations: settled.steps,
        residual_mean,
        residual_p95,
        last_move,
        log,
    };
    Ok(RegisteredBody { surface: model.template.with_points(points_in_bind), skeleton, pose, colors, uvs, report })
}

fn check_arguments(
    scan: &Scan,
    model: &BodyModel,
    fitted: &FittedBody,
    hints: &RegisterHints<'_>,
    params: &RegisterParams,
) -> Result<(), FitError> {
    let vertices = model.template.vertex_count();
    require_length("vertices of the fitted body, per vertex of the model", fitted.surface.vertex_count(), vertices)?;
    require_length("rotations of the fitted pose, per joint", fitted.pose.rotations.len(), model.skeleton.len())?;
    for (v, _) in hints.landmarks {
        require_range("the vertex of a landmark", v.index() as f64, 0.0, vertices.saturating_sub(1) as f64)?;
    }
    params.check()?;
    if scan.mesh.face_count() == 0 { Err(FitError::EmptyScan) } else { Ok(()) }
}

/// One sentence on faces turned over and triangles that cross.
fn soundness(start: &TriMesh, registered: &TriMesh) -> String {
    let turned = start.face_ids().filter(|&f| start.area_vector(f).dot(&registered.area_vector(f)) < 0.0).count();
    let crossing = |mesh| self_intersecting_pairs(mesh).len();
    let (before, after) = (crossing(start), crossing(registered));
    format!("{turned} faces turned over; {after} pairs of triangles cross, {before} before registration")
}

fn residual(surface: &ScanSurface, mesh: &TriMesh) -> (f64, f64) {
    let distances: Vec<f64> = mesh
        .points()
        .0
        .par_iter()
        .filter_map(|p| surface.nearest(p, 0.03).filter(|h| !h.at_rim).map(|h| h.distance))
        .collect();
    mean_and_p95(distances)
}
