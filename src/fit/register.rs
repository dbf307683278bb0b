//! The template moved onto the naked scan, non-rigidly.
//!
//! **Source** the surface of Hu 2017, §5.1 (Yamazaki 2013) in the manner of Amberg 2007: point-to-plane targets, a
//! membrane on the displacement whose stiffness is annealed, no pull where the scan has holes.

use super::elsewhere::{Elsewhere, SeenElsewhere, fill_colors, fill_targets};
use super::surface::{ScanHit, ScanSurface};
use super::texture::bake_texture;
use super::{FitError, FitReport, FittedBody, RegisteredBody, Step};
use crate::body::{BodyModel, JointId, Pose, Skeleton, unskin};
use crate::geometry::{
    Adjacency, PerVertex, Point, TriMesh, Vec3, VertexId, cotangent_laplacian, self_intersecting_pairs,
};
use crate::numerics::SparseCholesky;
use crate::scan::Scan;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How the template is moved onto the scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RegisterParams {
    /// Lengths over which the displacement may vary, in metres, one a round of iterations, falling.
    pub smoothing_lengths: Vec<f64>,
    /// Iterations a round.
    pub iterations: usize,
    /// Greatest distance of a correspondence in the first round, in metres; it falls to a third in the last.
    pub reach: f64,
    /// How much of the pull hands keep: a scanner's fingers are mittens, the model's are fingers.
    pub hand_pull: f64,
    /// How much of it toes keep: they melt together as fingers do, but the foot's outline is seen.
    pub toe_pull: f64,
}

impl Default for RegisterParams {
    fn default() -> Self {
        Self {
            smoothing_lengths: vec![0.06, 0.035, 0.02, 0.012, 0.008],
            iterations: 3,
            reach: 0.05,
            hand_pull: 0.1,
            toe_pull: 0.5,
        }
    }
}

/// What is known besides the scan.
#[derive(Clone, Copy, Debug, Default)]
pub struct Known<'a> {
    /// At which places of the scan, in its frame, some of the model's vertices lie.
    pub landmarks: &'a [(VertexId, Point)],
    /// Other scans of the same person: they say where skin lies that this one does not show.
    pub elsewhere: &'a [SeenElsewhere<'a>],
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
    on_step: &mut dyn FnMut(&Step),
) -> Result<RegisteredBody, FitError> {
    register_knowing(scan, model, fitted, &Known::default(), params, on_step)
}

/// The same, where more is known than the scan shows.
///
/// **Requires** landmarks of vertices of the model, and `shown` of as many.
pub fn register_knowing(
    scan: &Scan,
    model: &BodyModel,
    fitted: &FittedBody,
    known: &Known<'_>,
    params: &RegisterParams,
    on_step: &mut dyn FnMut(&Step),
) -> Result<RegisteredBody, FitError> {
    /// A landmark counts for as many vertices: it must carry along those around it, within the length of smoothing.
    const PULL: f64 = 30.0;
    let surface = ScanSurface::prepare(scan);
    let bare = fitted.figure(model);
    let others: Vec<Elsewhere> = known.elsewhere.iter().map(|seen| Elsewhere::prepare(seen, &bare)).collect();
    let start = fitted.surface.with_points(model.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose));
    let pull = pull_of_parts(model, params);
    let ground = Ground::under(scan, model);
    let mut displaced = start.clone();
    let rounds = params.smoothing_lengths.len();
    let mut iteration = 0;
    for (round, &length) in params.smoothing_lengths.iter().enumerate() {
        let t = if rounds > 1 { round as f64 / (rounds - 1) as f64 } else { 1.0 };
        let reach = params.reach * (1.0 - t * 2.0 / 3.0);
        for _ in 0..params.iterations {
            let mut targets = targets(&surface, &displaced, &ground.is_foot, reach);
            fill_targets(&mut targets, &others, &displaced, model, fitted, reach);
            targets.iter_mut().zip(pull.iter()).for_each(|(target, share)| {
                *target = target.map(|(place, pull)| (place, pull * share));
            });
            ground.hold_soles(&displaced, &mut targets);
            known.landmarks.iter().for_each(|&(v, place)| targets[v.index()] = Some((place, PULL)));
            let next = solve(&start, &targets, length)?;
            let (moved, residual) = (greatest_move(&displaced, &next), mean_distance(&displaced, &targets));
            iteration += 1;
            on_step(&Step { iteration, moved, residual, surface: &displaced });
            displaced = next;
        }
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
    let elsewhere = match count(&seen) - own {
        0 => String::new(),
        more => format!(", {more} more on other scans"),
    };
    let log = vec![
        format!("{own} of {} vertices lie on the scan{elsewhere}", model.template.vertex_count()),
        soundness(&start, &displaced),
    ];
    let report =
        FitReport { converged: true, iterations: iteration, residual_mean, residual_p95, log, ..FitReport::default() };
    Ok(RegisteredBody { surface: model.template.with_points(points_in_bind), skeleton, pose, colors, uvs, report })
}

/// What registration did to the surface's soundness, in words.
fn soundness(start: &TriMesh, registered: &TriMesh) -> String {
    let turned = start.face_ids().filter(|&f| start.area_vector(f).dot(&registered.area_vector(f)) < 0.0).count();
    let crossing = |mesh| self_intersecting_pairs(mesh).len();
    let (before, after) = (crossing(start), crossing(registered));
    format!("{turned} faces turned over; {after} pairs of triangles cross, {before} before registration")
}

/// What a standing person stands on: soles are what no scanner sees.
struct Ground {
    height: f64,
    is_foot: PerVertex<bool>,
}

impl Ground {
    fn under(scan: &Scan, model: &BodyModel) -> Self {
        // The lowest that was seen: at most a few millimetres of a sole's edge too high. A stray point below it holds less.
        let height = scan.mesh.bounds().map_or(0.0, |b| b.min.y);
        let skeleton = &model.skeleton;
        let feet = ["leftFoot", "rightFoot"].map(|name| skeleton.find_name(name));
        let is_foot = |j: JointId| feet.iter().flatten().any(|&foot| skeleton.is_below(j, foot));
        let of_foot = model.weights.rows().iter().map(|row| is_foot(row[0].0)).collect();
        Self { height, is_foot: of_foot }
    }

    /// Draws soles that have sunk below the ground and match nothing up to it.
    fn hold_soles(&self, mesh: &TriMesh, targets: &mut [Target]) {
        /// Soles further down belong to feet that the scan cuts off: nothing is known of their ground. Metres.
        const DEEPEST: f64 = 0.03;
        for (v, p) in mesh.points().enumerate() {
            let depth = self.height - p.y;
            if self.is_foot[v] && (0.0..DEEPEST).contains(&depth) {
                let on_ground = Point::new(p.x, self.height, p.z);
                targets[v.index()].get_or_insert((on_ground, 1.0));
            }
        }
    }
}

/// Where a vertex is drawn to, and how strongly (0–1).
pub(super) type Target = Option<(Point, f64)>;

fn pull_of_parts(model: &BodyModel, params: &RegisterParams) -> PerVertex<f64> {
    let skeleton = &model.skeleton;
    let part = |joint: &str| ["left", "right"].map(|side| skeleton.find_name(&format!("{side}{joint}")));
    let (hands, toes) = (part("Hand"), part("Toes"));
    let below = |j: JointId, part: &[Option<JointId>; 2]| part.iter().flatten().any(|&p| skeleton.is_below(j, p));
    let pull_of_joint = |j: JointId| match j {
        j if below(j, &toes) => params.toe_pull,
        // The hand, and whatever fingers a model has.
        j if below(j, &hands) => params.hand_pull,
        _ => 1.0,
    };
    let pulls: Vec<f64> = skeleton.ids().map(pull_of_joint).collect();
    model
        .weights
        .rows()
        .iter()
        .map(|row| row.iter().map(|(j, w)| w * pulls.get(j.index()).copied().unwrap_or(1.0)).sum())
        .collect()
}

/// The nearest place of the scan, if it faces the same way. For the tips of toes that lie behind or before the scan's, the
/// nearest place is the top of its foot, which does not: they look along their normals, forward and back.
fn targets(surface: &ScanSurface, mesh: &TriMesh, is_foot: &PerVertex<bool>, reach: f64) -> Vec<Target> {
    let normals = mesh.vertex_normals();
    (0..mesh.vertex_count())
        .into_par_iter()
        .map(|i| {
            let (p, n) = (&mesh.points().0[i], &normals.0[i]);
            let ahead = || {
                let hits = [*n, -n].into_iter().filter_map(|way| surface.along(p, &way, reach));
                hits.filter(|hit| agrees(hit, n)).map(|hit| on_plane(&hit, p, reach)).next()
            };
            pulled_to(surface, p, n, reach).or_else(|| if is_foot.0[i] { ahead() } else { None })
        })
        .collect()
}

/// Where the nearest place of a scan draws a vertex, if it faces the same way.
pub(super) fn pulled_to(surface: &ScanSurface, p: &Point, n: &Vec3, reach: f64) -> Target {
    surface.nearest(p, reach).filter(|hit| agrees(hit, n)).map(|hit| on_plane(&hit, p, reach))
}

fn agrees(hit: &ScanHit, normal: &Vec3) -> bool {
    /// Normals further apart than this belong to another side of the body (the arm's against the flank's).
    const LEAST_COSINE: f64 = 0.5;
    !hit.at_rim && hit.normal.dot(normal) >= LEAST_COSINE
}

fn on_plane(hit: &ScanHit, p: &Point, reach: f64) -> (Point, f64) {
    let place = p + hit.normal * hit.normal.dot(&(hit.point - p));
    // How well a place was seen does not count here: what was seen badly is noisy, but all that shows a finger.
    (place, 1.0 / (1.0 + (hit.distance / (0.5 * reach)).powi(2)).powi(2))
}

/// Minimises `Σ area · pull |x + d − target|² + length² dᵀLd` over the displacement `d` from `start`.
fn solve(start: &TriMesh, targets: &[Target], length: f64) -> Result<TriMesh, FitError> {
    /// Pull of an unseen vertex toward no displacement, against 1 for a seen one: only keeps islands determined.
    const UNSEEN_PULL: f64 = 2e-3;
    let laplacian = cotangent_laplacian(start);
    let mut triplets: Vec<(usize, usize, f64)> =
        laplacian.triplets.iter().map(|&(r, c, v)| (r, c, v * length * length)).collect();
    let mut right = vec![Vec3::zeros(); targets.len()];
    for (i, target) in targets.iter().enumerate() {
        let area = laplacian.mass.0[i].max(1e-9);
        match target {
            Some((point, pull)) => {
                triplets.push((i, i, area * (pull + UNSEEN_PULL)));
                right[i] = (point - start.points().0[i]) * (area * pull);
            }
            None => triplets.push((i, i, area * UNSEEN_PULL)),
        }
    }
    let factor =
        SparseCholesky::prepare(targets.len(), &triplets).map_err(|e| FitError::Singular { reason: e.to_string() })?;
    let displacement = factor.solve_vectors(&right);
    Ok(start.with_points(start.points().iter().zip(&displacement).map(|(p, d)| p + d).collect::<PerVertex<Point>>()))
}

/// Of the vertices from their targets, each as it is pulled.
fn mean_distance(mesh: &TriMesh, targets: &[Target]) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for (p, (target, pull)) in mesh.points().iter().zip(targets).filter_map(|(p, t)| Some((p, t.as_ref()?))) {
        sum += pull * (p - target).norm();
        total += pull;
    }
    sum / f64::max(total, 1e-12)
}

fn greatest_move(a: &TriMesh, b: &TriMesh) -> f64 {
    a.points().iter().zip(b.points().iter()).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max)
}

fn residual(surface: &ScanSurface, mesh: &TriMesh) -> (f64, f64) {
    let mut distances: Vec<f64> = mesh
        .points()
        .0
        .par_iter()
        .filter_map(|p| surface.nearest(p, 0.03).filter(|h| !h.at_rim).map(|h| h.distance))
        .collect();
    distances.sort_by(f64::total_cmp);
    let count = distances.len().max(1);
    (distances.iter().sum::<f64>() / count as f64, distances.get(count * 95 / 100).copied().unwrap_or(0.0))
}

/// Colours of the nearest places of the scan.
fn colors_of(surface: &ScanSurface, colors: &PerVertex<[u8; 3]>, mesh: &TriMesh) -> Vec<Option<Vec3>> {
    let normals = mesh.vertex_normals();
    let at = |i: usize| color_at(surface, colors, &mesh.points().0[i], &normals.0[i]);
    (0..mesh.vertex_count()).into_par_iter().map(at).collect()
}

/// The colour of the nearest place of a scan, if that faces nearly the same way.
pub(super) fn color_at(surface: &ScanSurface, colors: &PerVertex<[u8; 3]>, p: &Point, n: &Vec3) -> Option<Vec3> {
    /// Beyond this distance a colour belongs to something else. Metres.
    const REACH: f64 = 0.02;
    let s = surface.index.closest_within(p, REACH)?;
    let corners = surface.mesh().faces()[s.face];
    let normal: Vec3 = (0..3).map(|k| surface.normals[corners[k]] * s.barycentric[k]).sum();
    (normal.dot(n) > 0.3)
        .then(|| (0..3).map(|k| Vec3::from(colors[corners[k]].map(f64::from)) * s.barycentric[k]).sum())
}

/// Where no colour is known those around it flow in.
fn flowed_in(mut baked: Vec<Option<Vec3>>, mesh: &TriMesh) -> PerVertex<[u8; 3]> {
    let adjacency = Adjacency::prepare(mesh);
    // Each pass reaches one ring further into what was not seen.
    while baked.iter().any(Option::is_none) {
        let before = baked.clone();
        for v in mesh.vertex_ids().filter(|v| before[v.index()].is_none()) {
            let known: Vec<Vec3> = adjacency.neighbours_of(v).iter().filter_map(|n| before[n.index()]).collect();
            if !known.is_empty() {
                baked[v.index()] = Some(known.iter().sum::<Vec3>() / known.len() as f64);
            }
        }
        if baked.iter().filter(|c| c.is_none()).count() == before.iter().filter(|c| c.is_none()).count() {
            break;
        }
    }
    /// Skin where no colour at all is known.
    const PLAIN: Vec3 = Vec3::new(200.0, 170.0, 150.0);
    baked.into_iter().map(|c| c.unwrap_or(PLAIN).map(|x| x.round().clamp(0.0, 255.0) as u8).into()).collect()
}

/// Finds bind-pose points and a skeleton inside them that the fit's rotations carry onto `points_in_world`.
///
/// The skeleton follows from the points (Eq. 1) and the points from the skeleton (Eq. 3 inverted): a fixed point, found
/// by repetition. Near the bind pose each round shrinks the error; it is halved for limbs turned far.
fn into_bind_pose(
    model: &BodyModel,
    fitted: &FittedBody,
    points_in_world: &PerVertex<Point>,
) -> (PerVertex<Point>, Skeleton, Pose) {
    const ROUNDS: usize = 12;
    const DAMPING: f64 = 0.7;
    let mut skeleton = fitted.skeleton.clone();
    let mut pose = fitted.pose.clone();
    for _ in 0..ROUNDS {
        let points = unskin(points_in_world, &model.weights, &skeleton, &pose);
        let found = model.skeleton_inside(&points);
        // The root stays where it was in the bind pose; its place in the world goes into the translation.
        let root_in_world = skeleton.world_from_bind(&pose)[0] * found.joints_in_bind[0];
        let shift = skeleton.joints_in_bind[0] - found.joints_in_bind[0];
        for (joint, target) in skeleton.joints_in_bind.iter_mut().zip(&found.joints_in_bind) {
            *joint += (target + shift - *joint) * DAMPING;
        }
        pose.translation = root_in_world - skeleton.joints_in_bind[0];
    }
    let points = unskin(points_in_world, &model.weights, &skeleton, &pose);
    (points, skeleton, pose)
}
