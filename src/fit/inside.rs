//! The figure dressed so far, posed inside the next scan: Hu 2017, Eqs. 5–6.
//!
//! Eq. 5 is the articulated ICP of the naked fit over what the scan should show of the figure. Eq. 6 is held as a
//! constraint: each Gauss–Newton step is a quadratic program with a row `n·(q − v) ≥ margin` for each body vertex that
//! cloth hides, and an exact L1 slack so that a scan smaller than the figure is an answer and not a failure.

use super::articulated::{Articulated, Posed, Residual};
use super::dressed::{Dressed, MAY_REACH};
use super::inside_params::{InsideMethod, InsideParams};
use super::lack::Lack;
use super::normal_equations::{NormalEquations, PosePrior, Unknowns};
use super::offset::bounded_offsets;
use super::prior::{held_joints, pose_stiffness};
use super::side::{Side, side_of};
use super::surface::{ScanSurface, mean_gap, robust, scan_to_mesh, spread};
use super::{Cover, FitError, FitReport, PoseInside, Step};
use crate::body::{Figure, JointId, JointLimits, Pose, Shape, Skeleton};
use crate::geometry::{PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId};
use crate::numerics::{QpRow, QuadraticProgram};
use crate::scan::Scan;
use nalgebra::DVector;
use rayon::prelude::*;

/// Distance along the body from where skin may show, in metres, within which a template's limit is not trusted: collars
/// and cuffs differ by as much from shirt to shirt.
pub(crate) const UNSURE: f64 = 0.04;

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
    on_step: &mut dyn FnMut(&Step),
) -> Result<PoseInside, FitError> {
    if scan.mesh.face_count() == 0 {
        return Err(FitError::EmptyScan);
    }
    let (surface, dressed) = rayon::join(|| ScanSurface::prepare(scan), || Dressed::prepare(figure, cover));
    let mut solver = Solver::new(figure, &dressed, &surface, limits, params);
    let mut log = Vec::new();

    let previous = start;
    let start = solver.best_start(start, &mut log);
    let mut found = solver.refine(start.clone(), previous, on_step, &mut log);
    let unseen = solver.unseen_limbs(previous, &found.pose);
    if !unseen.is_empty() {
        solver.leave_out(&unseen, &mut log);
        found = solver.refine(with_limbs_of(start, previous, &figure.skeleton, &unseen), previous, on_step, &mut log);
    }

    let posed = solver.posed(&found.pose);
    let (residual_mean, residual_p95) = solver.distances_of_shown(&posed);
    let body_mesh = solver.body_mesh(&posed);
    let needed = solver.needed_offsets(&posed, &body_mesh);
    let offsets = if params.constrained && params.method == InsideMethod::Robust {
        let along_normals = needed.iter().map(|need| need.map(|need| need.along_normal)).collect();
        bounded_offsets(&body_mesh, &along_normals, params.greatest_offset)
    } else {
        PerVertex::filled(0.0, dressed.body_count)
    };
    let lack = Lack::of(&solver.hidden_areas(&body_mesh), &needed, &offsets, |v| solver.margin_under(v));
    let agreement = solver.agreement(&posed);
    solver.refuse_what_is_not_this_figure(residual_mean, &lack, &agreement, &unseen, &posed)?;
    log.extend(lack.told(&figure.skeleton, &figure.body().weights));
    log.extend(agreement.told());
    log.extend(solver.unseen_head(&posed).map(String::from));
    if !found.converged {
        log.push(format!("not converged after {} iterations: look at the result", found.iterations));
    }
    let moved = offsets.iter().filter(|o| **o < 0.0).count();
    log.push(format!("{moved} of {} body vertices are drawn in by the bounded offset", dressed.body_count));
    let report = FitReport {
        converged: found.converged,
        iterations: found.iterations,
        residual_mean,
        residual_p95,
        outside_share: lack.outside_share,
        outside_depth: lack.outside_depth,
        joint_change: joint_change(&figure.skeleton, previous, &found.pose),
        proximity: solver.proximity(previous, &found.pose, &offsets),
        confidence: agreement.explained * agreement.seen * (1.0 - lack.outside_share),
        explained_share: agreement.explained,
        seen_share: agreement.seen,
        log,
    }
    .doubted();
    Ok(PoseInside { pose: found.pose, offsets, report })
}

/// A pose whose limbs, from these joints on, are as in another, seen from where they hang.
fn with_limbs_of(mut pose: Pose, other: &Pose, skeleton: &Skeleton, limbs: &[JointId]) -> Pose {
    for j in skeleton.ids().filter(|&j| limbs.iter().any(|&limb| skeleton.is_below(j, limb))) {
        pose.rotations[j.index()] = other.rotations[j.index()];
    }
    pose
}

/// What the iterations came to.
struct Found {
    pose: Pose,
    iterations: usize,
    converged: bool,
}

/// Mean move of the joints from one pose to another, as seen from the root: metres.
fn joint_change(skeleton: &Skeleton, from: &Pose, to: &Pose) -> f64 {
    let (before, after) = (seen_from_root(skeleton, from), seen_from_root(skeleton, to));
    before.iter().zip(&after).map(|(p, q)| (p - q).norm()).sum::<f64>() / before.len().max(1) as f64
}

/// The joints in the root's frame.
pub(super) fn seen_from_root(skeleton: &Skeleton, pose: &Pose) -> Vec<Point> {
    let root = skeleton.world_from_bind(pose)[0].inverse();
    skeleton.joints_in_world(pose).iter().map(|p| root * p).collect()
}

pub(super) struct Solver<'a> {
    pub(super) body: Articulated<'a>,
    /// The body's surface in the bind pose.
    pub(super) bare: &'a TriMesh,
    pub(super) dressed: &'a Dressed,
    pub(super) surface: &'a ScanSurface,
    limits: &'a [JointLimits],
    pub(super) params: &'a InsideParams,
    /// Joints that keep the pose of the start.
    pub(super) held: Vec<bool>,
    /// Vertices that take no part, for the scan does not show them.
    pub(super) left_out: PerVertex<bool>,
}

impl<'a> Solver<'a> {
    pub(super) fn new(
        figure: &'a Figure,
        dressed: &'a Dressed,
        surface: &'a ScanSurface,
        limits: &'a [JointLimits],
        params: &'a InsideParams,
    ) -> Self {
        let held = held_joints(&figure.skeleton, params.joints);
        let bare = &figure.body().mesh;
        let left_out = PerVertex::filled(false, dressed.mesh_in_bind.vertex_count());
        Self { body: dressed.articulated(figure), bare, dressed, surface, limits, params, held, left_out }
    }

    pub(super) fn posed(&self, pose: &Pose) -> Posed {
        self.body.posed(pose, &Shape(Vec::new()))
    }

    /// How strongly each joint is drawn to the step before: more where wide cloth hides what it moves, for then nothing but
    /// the ends of a limb says where its middle is.
    pub(super) fn stiffness(&self) -> Vec<f64> {
        /// In a wide sleeve an elbow was moved by 9 mm that had moved by none, for 4 mm of error at the hand. So many times
        /// the pull halved that; on 20 invented people in wide clothes joints lay as near to the truth as before.
        const HIDDEN: f64 = 4.0;
        let of_skeleton = pose_stiffness(&self.body.skeleton, self.params.pose_prior);
        if self.params.method == InsideMethod::Paper {
            return of_skeleton;
        }
        let hidden = self.dressed.loose_shares(self.bare, self.body.joint_count());
        of_skeleton.into_iter().zip(hidden).map(|(s, share)| s * (1.0 + (HIDDEN - 1.0) * share)).collect()
    }

    pub(super) fn prior<'b>(&'b self, center: &'b Pose, stiffness: &'b [f64]) -> PosePrior<'b> {
        PosePrior { center, stiffness, limits: self.limits, limit_stiffness: 2e4 }
    }

    fn refine(&self, start: Pose, previous: &Pose, on_step: &mut dyn FnMut(&Step), log: &mut Vec<String>) -> Found {
        /// A joint moved less than this in a step, in metres.
        const STILL: f64 = 3e-4;
        /// Cosine between two steps one of which takes the other back, and the move of a joint, in metres, below which that is
        /// chatter: 0.7 mm to and fro were seen where a slit showed the skin below a skirt.
        const AGAINST: f64 = -0.5;
        const CHATTER: f64 = 2e-3;
        let mut pose = start;
        let (mut last_delta, mut share, mut moved) = (DVector::zeros(self.body.unknown_count()), 1.0, f64::INFINITY);
        let stiffness = self.stiffness();
        let figure_samples = self.samples(self.params.samples);
        let scan_samples = self.surface.trusted_samples(self.params.samples);
        let unknowns = Unknowns { joints: self.held.iter().map(|held| !held).collect(), shape: false };
        let mut index: Option<SurfaceIndex> = None;
        let mut still = 0;
        for iteration in 0..self.params.iterations {
            let t = (iteration as f64 / 8.0).min(1.0);
            let reach = 0.12 * (1.0 - t) + 0.03 * t;
            let posed = self.posed(&pose);
            let mesh = self.mesh(&posed);
            let normals = mesh.vertex_normals();
            let index = match &mut index {
                Some(index) => {
                    index.follow(&mesh);
                    index
                }
                none => none.insert(SurfaceIndex::prepare(&mesh)),
            };
            let mut residuals = self.figure_to_scan(&posed, &normals, &figure_samples, reach, 0.3 + 0.3 * t);
            residuals.extend(self.scan_to_figure(index, &normals, &scan_samples, reach, 0.3 + 0.3 * t));
            let mut equations = self.body.normal_equations(&posed, &residuals, &unknowns);
            equations.add_pose_prior(&posed, &pose, &self.prior(previous, &stiffness));
            for i in 0..equations.h.nrows() {
                equations.h[(i, i)] = equations.h[(i, i)] * (1.0 + 1e-4) + 1e-6;
            }
            equations.freeze_all_but(&unknowns);
            let delta = if self.params.constrained && iteration >= 2 {
                self.constrained_step(&posed, &normals, equations, log)
            } else {
                equations.solve(0.0)
            };
            let Some(mut delta) = delta else { break };
            // Where skin is as near to one side of the scan as to another, steps go to and fro: less and less far, then.
            let turned_back = delta.dot(&last_delta) < AGAINST * delta.norm() * last_delta.norm();
            share = if turned_back && moved < CHATTER { 0.5 * share } else { share };
            last_delta.copy_from(&delta);
            delta *= share;
            let next = self.body.stepped(&posed, &pose, &Shape(Vec::new()), &delta).0;
            let after = posed.skeleton.joints_in_world(&next);
            moved = posed.joints_in_world.iter().zip(&after).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            pose = next;
            on_step(&Step { iteration: iteration + 1, moved, residual: mean_gap(&residuals), surface: &mesh });
            still = if moved < STILL && t >= 1.0 { still + 1 } else { 0 };
            if still >= 2 {
                return Found { pose, iterations: iteration + 1, converged: true };
            }
        }
        Found { pose, iterations: self.params.iterations, converged: still > 0 }
    }

    /// How far inside each hidden vertex must be after a step, before the offset.
    pub(super) fn wanted_at(&self, v: VertexId) -> f64 {
        match self.params.method {
            InsideMethod::Robust => self.margin_at(v) - self.params.give,
            InsideMethod::Paper => 0.0,
        }
    }

    /// The Gauss–Newton step that keeps every hidden vertex inside by the margin: Eq. 6.
    fn constrained_step(
        &self,
        posed: &Posed,
        normals: &PerVertex<Vec3>,
        equations: NormalEquations,
        log: &mut Vec<String>,
    ) -> Option<DVector<f64>> {
        /// Vertices with more clearance than this cannot be carried outside by one step. Metres.
        const NEAR: f64 = 0.03;
        /// Cost of a metre outside, a vertex: above the pull of the data that one vertex can bear (a residual of 5 mm
        /// on one observation pulls with 200), so that the slack is used only where nothing else is possible.
        const SLACK_WEIGHT: f64 = 4e3;
        let sides = self.sides(posed, normals);
        let slack_weight = Some(SLACK_WEIGHT * self.trust_in_constraint(&sides));
        let is_free = |column: usize| column < 3 || !self.held[(column - 3) / 3];
        let rows = sides
            .into_iter()
            .enumerate()
            .filter_map(|(i, side)| side.filter(|s| s.clearance < NEAR).map(|s| (VertexId::from_index(i), s)))
            .map(|(v, side)| {
                let row = self.body.gradient(posed, &Residual::on_vertex(v, side.normal, 0.0, 1.0));
                let coefficients = row.into_iter().filter(|&(column, _)| is_free(column)).collect();
                QpRow { coefficients, bound: side.clearance - self.wanted_at(v), slack_weight }
            })
            .collect();
        let fallback = equations.solve(0.0);
        let program = QuadraticProgram { quadratic: equations.h, linear: -equations.g, rows };
        match program.solve() {
            Ok(outcome) if outcome.is_usable() => Some(DVector::from_vec(outcome.x)),
            Ok(outcome) => {
                log.push(format!(
                    "the quadratic program ended as {:?}; a step without the constraint was taken",
                    outcome.status
                ));
                fallback
            }
            Err(e) => {
                log.push(format!("the quadratic program was refused: {e}"));
                fallback
            }
        }
    }

    /// 1 where few hidden vertices lie too far outside for the offset; less the more do. A trunk that is too thick all around
    /// has no pose that takes it in, and all of its vertices together would turn legs away from their data.
    fn trust_in_constraint(&self, sides: &[Option<Side>]) -> f64 {
        /// Share of the vertices. Scans of the right person come to 0.1 % at the end.
        const FEW: f64 = 0.02;
        if self.params.method == InsideMethod::Paper {
            return 1.0;
        }
        let lacks = |(v, side): (usize, &Side)| self.wanted_at(VertexId::from_index(v)) - side.clearance;
        let seen = || sides.iter().enumerate().filter_map(|(v, side)| Some((v, side.as_ref()?)));
        let outside = seen().filter(|at| lacks(*at) > self.params.greatest_offset).count() as f64;
        (FEW * seen().count() as f64 / outside.max(1.0)).min(1.0)
    }

    /// For each body vertex that must stay inside and that the scan saw, where it lies.
    pub(super) fn sides(&self, posed: &Posed, normals: &PerVertex<Vec3>) -> Vec<Option<Side>> {
        (0..self.dressed.body_count)
            .into_par_iter()
            .map(|i| {
                let v = VertexId::from_index(i);
                if self.left_out[v] || !(self.dressed.must_stay_inside(v) || self.dressed.may_be_covered(v)) {
                    return None;
                }
                side_of(self.surface, &posed.points[v], &normals[v])
            })
            .collect()
    }

    /// The margin where a vertex lies under inner layers too: each is cloth between the skin and what is observed.
    pub(super) fn margin_under(&self, v: VertexId) -> f64 {
        if self.dressed.may_be_covered(v) {
            return self.params.margin;
        }
        self.params.margin + self.params.thickness * self.dressed.layers_over[v]
    }

    /// What a pose must keep: the margin, less near places where skin may show. There the scan may be the skin itself,
    /// noise and all, and only the bounded offset holds the whole margin.
    fn margin_at(&self, v: VertexId) -> f64 {
        /// Noise of the scan plus the error of the registered surface, where both are the same skin. Metres.
        const TOLERANCE: f64 = 0.006;
        let depth = match self.dressed.may_be_covered(v) {
            true => 0.0,
            false => (self.dressed.under_cover[v] / UNSURE).min(1.0),
        };
        self.margin_under(v) - TOLERANCE * (1.0 - depth)
    }

    pub(super) fn mesh(&self, posed: &Posed) -> TriMesh {
        self.dressed.mesh_in_bind.with_points(posed.points.clone())
    }

    pub(super) fn normals(&self, posed: &Posed) -> PerVertex<Vec3> {
        self.mesh(posed).vertex_normals()
    }

    /// Vertices that take part as data: shown ones, and those under cloth that lies close. Loose cloth is a wall, no
    /// data: pulls toward it (evenly around arms, or where it should rest on shoulders) were tried on a coat and moved the
    /// arms away from their truth.
    pub(super) fn samples(&self, count: usize) -> Vec<(VertexId, f64)> {
        let mut areas = self.telling_areas();
        areas.0.iter_mut().zip(self.left_out.iter()).filter(|(_, out)| **out).for_each(|(a, _)| *a = 0.0);
        spread(&areas, count)
    }

    /// The area of each vertex, as far as it says anything of the pose where the scan shows it.
    pub(super) fn telling_areas(&self) -> PerVertex<f64> {
        let mut areas = self.dressed.mesh_in_bind.vertex_areas();
        for (i, a) in areas.0.iter_mut().enumerate() {
            let v = VertexId::from_index(i);
            let is_data = self.params.method == InsideMethod::Paper || self.dressed.cover[v] != Cover::Loose;
            *a *= if self.dressed.hidden[v] || !is_data { 0.0 } else { self.trust(v) };
        }
        areas
    }

    fn trust(&self, v: VertexId) -> f64 {
        if self.params.method == InsideMethod::Paper { 1.0 } else { self.dressed.trust[v] }
    }

    pub(super) fn figure_to_scan(
        &self,
        posed: &Posed,
        normals: &PerVertex<Vec3>,
        samples: &[(VertexId, f64)],
        reach: f64,
        least_cosine: f64,
    ) -> Vec<Residual> {
        /// Close cloth lies this far off without pulling. Metres: ease of 5 cm in girth.
        const CLOSE_CLOTH: f64 = 0.008;
        /// Weight of close cloth against skin that shows.
        const TIGHT_WEIGHT: f64 = 0.1;
        samples
            .par_iter()
            .filter_map(|&(v, area)| {
                let p = posed.points[v];
                let hit = self.surface.nearest(&p, reach)?;
                if hit.at_rim || hit.normal.dot(&normals[v]) < least_cosine {
                    return None;
                }
                let gap = hit.normal.dot(&(hit.point - p));
                let weight = hit.trust * robust(area, hit.distance, reach);
                match self.dressed.cover[v] {
                    _ if self.params.method == InsideMethod::Paper => {
                        Some(Residual::on_vertex(v, hit.normal, gap, weight))
                    }
                    // Beside the cloth the scan may be skin or a hem: it is sure only that it is not further in.
                    Cover::Bare if gap > 0.0 => {
                        let sure = TIGHT_WEIGHT + (1.0 - TIGHT_WEIGHT) * self.dressed.beyond_cover[v] / MAY_REACH;
                        Some(Residual::on_vertex(v, hit.normal, gap, weight * sure))
                    }
                    Cover::Bare => Some(Residual::on_vertex(v, hit.normal, gap, weight)),
                    _ => (gap > CLOSE_CLOTH)
                        .then(|| Residual::on_vertex(v, hit.normal, gap - CLOSE_CLOTH, weight * TIGHT_WEIGHT)),
                }
            })
            .collect()
    }

    fn scan_to_figure(
        &self,
        posed: &SurfaceIndex,
        normals: &PerVertex<Vec3>,
        samples: &[(VertexId, f64)],
        reach: f64,
        least_cosine: f64,
    ) -> Vec<Residual> {
        let is_plain = self.params.method == InsideMethod::Paper;
        let takes = |corners: &[VertexId; 3]| {
            // Where cloth hangs the scan's nearest place on it is as good as any other.
            let is_telling = |c: VertexId| self.dressed.is_shown(c) && self.trust(c) > 0.5;
            corners.iter().all(|&c| !self.left_out[c] && (is_telling(c) || (is_plain && !self.dressed.hidden[c])))
        };
        scan_to_mesh(self.surface, posed, normals, samples, reach, least_cosine, takes)
    }

    /// Mean truncated distance of shown surface to the scan.
    pub(super) fn score(&self, pose: &Pose) -> f64 {
        self.distances_of_shown(&self.posed(pose)).0
    }

    /// Mean and 95th percentile of the distance of shown surface to the scan, truncated.
    fn distances_of_shown(&self, posed: &Posed) -> (f64, f64) {
        /// An arm that points elsewhere counts as this far. Metres.
        const TRUNCATE: f64 = 0.15;
        let normals = self.normals(posed);
        let mut distances: Vec<f64> = self
            .samples(self.params.samples / 2)
            .into_par_iter()
            .filter(|&(v, _)| self.dressed.is_shown(v))
            .filter_map(|(v, _)| match self.surface.nearest(&posed.points[v], TRUNCATE) {
                Some(hit) if hit.at_rim => None,
                Some(hit) if hit.normal.dot(&normals[v]) > 0.0 => Some(hit.distance),
                _ => Some(TRUNCATE),
            })
            .collect();
        distances.sort_by(f64::total_cmp);
        if distances.is_empty() {
            return (0.0, 0.0);
        }
        let mean = distances.iter().sum::<f64>() / distances.len() as f64;
        (mean, distances[(distances.len() * 95 / 100).min(distances.len() - 1)])
    }
}
