//! The registration: rounds of targets and smooth displacements.

use super::bind_pose::into_bind_pose;
use super::colors::{colors_of, flowed_in};
use super::displacement::{greatest_move, mean_distance, solve};
use super::fill_in::{FillInView, PreparedView, fill_colors, fill_targets};
use super::ground::Ground;
use super::params::RegisterParams;
use super::registered_body::RegisteredBody;
use super::targets::{Target, target_weights, targets};
use super::texture::bake_texture;
use crate::body::BodyModel;
use crate::fit::correspondence::{ScanSurface, mean_and_p95};
use crate::fit::error::FitError;
use crate::fit::naked::FittedBody;
use crate::fit::report::FitReport;
use crate::fit::solver::{FitIteration, StoppingRule, iterate};
use crate::geometry::{Point, TriMesh, VertexId, self_intersecting_pairs};
use crate::scan::Scan;
use rayon::prelude::*;

/// What is known besides the scan.
#[derive(Clone, Copy, Debug, Default)]
pub struct RegisterHints<'a> {
    /// At which places of the scan, in its frame, some of the model's vertices lie.
    pub landmarks: &'a [(VertexId, Point)],
    /// Other scans of the same person: they say where skin lies that this one does not show.
    pub fill_in: &'a [FillInView<'a>],
}

/// Registers the model's surface to the scan and carries it back into the bind pose.
///
/// **Guarantees** the result has the model's vertices and faces; skinned with its pose it is the registered surface.
///
/// **Errors** [`FitError::Singular`] for a template whose Laplacian cannot be factored.
pub fn register(
    scan: &Scan,
    model: &BodyModel,
    fitted: &FittedBody,
    params: &RegisterParams,
    on_step: &mut dyn FnMut(&FitIteration),
) -> Result<RegisteredBody, FitError> {
    register_with_hints(scan, model, fitted, &RegisterHints::default(), params, on_step)
}

/// The same, where more is known than the scan shows.
///
/// **Requires** landmarks of vertices of the model, and `shown` of as many.
pub fn register_with_hints(
    scan: &Scan,
    model: &BodyModel,
    fitted: &FittedBody,
    hints: &RegisterHints<'_>,
    params: &RegisterParams,
    on_step: &mut dyn FnMut(&FitIteration),
) -> Result<RegisteredBody, FitError> {
    /// A landmark counts for as many vertices: it must carry along those around it, within the length of smoothing.
    const PULL: f64 = 30.0;
    let surface = ScanSurface::prepare(scan);
    let bare = fitted.figure(model);
    let others: Vec<PreparedView> = hints.fill_in.iter().map(|seen| PreparedView::prepare(seen, &bare)).collect();
    let start = fitted.surface.with_points(model.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose));
    let pull = target_weights(model, params);
    let ground = Ground::under(scan, model);
    let mut displaced = start.clone();
    let rounds = params.smoothing_lengths.len();
    let steps = rounds * params.iterations;
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
        hints.landmarks.iter().for_each(|&(v, place)| targets[v.index()] = Some((place, PULL)));
        let next = solve(&start, &targets, length)?;
        let (moved, residual) = (greatest_move(&displaced, &next), mean_distance(&displaced, &targets));
        on_step(&FitIteration { iteration: number + 1, moved, residual, surface: &displaced });
        displaced = next;
        Ok::<_, FitError>(moved)
    });
    if let Some(error) = settled.stopped {
        return Err(error);
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
    let count = |targets: &[Target]| targets.iter().filter(|t| t.is_some()).count();
    let own = count(&seen);
    fill_targets(&mut seen, &others, &displaced, model, fitted, 0.02);
    let fill_in = match count(&seen) - own {
        0 => String::new(),
        more => format!(", {more} more on other scans"),
    };
    let log = vec![
        format!("{own} of {} vertices lie on the scan{fill_in}", model.template.vertex_count()),
        soundness(&start, &displaced),
    ];
    let report = FitReport {
        converged: true,
        iterations: settled.steps,
        residual_mean,
        residual_p95,
        log,
        ..FitReport::default()
    };
    Ok(RegisteredBody { surface: model.template.with_points(points_in_bind), skeleton, pose, colors, uvs, report })
}

/// What registration did to the surface's soundness, in words.
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
