//! One body from all scans of a session: the shape that the naked scan and what shows of the skin in the others agree on,
//! with no scan that the body would have to leave.
//!
//! Gauss–Newton over one β and a pose a scan: the terms of the naked fit (Hu 2017, Eq. 4); of each other scan those of
//! Eq. 5 over bare skin, and Eq. 6 one-sided over covered skin. The poses are eliminated, so that a step costs as many
//! small systems as there are scans.

use super::articulated::{Articulated, Posed, Residual};
use super::dressed::Dressed;
use super::inside::{self, fit_inside};
use super::naked::{self, FINEST, Found, NakedParams};
use super::normal_equations::{NormalEquations, PosePrior, Unknowns, solve_together};
use super::prior::pose_stiffness;
use super::surface::{LastFaces, ScanSurface, robust, scan_to_mesh_from, spread};
use super::{Cover, FitReport, FittedBody, InsideParams, Step};
use crate::body::{BodyModel, Figure, Pose, Shape};
use crate::geometry::{PerVertex, SurfaceIndex, TriMesh, VertexId};
use crate::scan::Scan;
use serde::{Deserialize, Serialize};

/// What makes the shape of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ShapeFrom {
    /// The naked scan alone: what is dressed later changes nothing of the body.
    Naked,
    /// All scans of the session together.
    All,
}

/// Another scan of the same person.
#[derive(Clone, Debug)]
pub struct OtherScan<'a> {
    /// What the report calls it.
    pub name: &'a str,
    /// The scan.
    pub scan: &'a Scan,
    /// What all that is worn in it does over the body.
    pub cover: PerVertex<Cover>,
    /// How the body is laid into it at first.
    pub params: InsideParams,
}

/// Iterations at most: poses and shape are nearly right from the start.
const ITERATIONS: usize = 20;

/// Refines the shape of a body fitted to its naked scan by other scans of the same person.
///
/// **Frame** `elsewhere` of the result holds poses in each scan's world frame.
///
/// **Guarantees** a scan into which the body cannot be laid takes no part, and the report says why. Where the others
/// contradict the naked scan, so that the body would lie further from it or be none, it keeps its shape, and the report says
/// that.
pub fn fit_together(
    scan: &Scan,
    fitted: &FittedBody,
    others: &[OtherScan<'_>],
    model: &BodyModel,
    params: &NakedParams,
    on_step: &mut dyn FnMut(&Step),
) -> FittedBody {
    let surface = ScanSurface::prepare(scan);
    let mut naked = naked::Solver::prepare(model, SurfaceIndex::prepare(&model.template), &surface, params);
    naked.leave_out(&fitted.unseen);
    let figure = fitted.figure(model);
    let mut log = fitted.report.log.clone();

    let laid = laid_into_each(&figure, fitted, others, model, &mut log);
    let prepared: Vec<(ScanSurface, Dressed)> = others
        .iter()
        .map(|other| (ScanSurface::prepare(other.scan), Dressed::prepare(&figure, &other.cover)))
        .collect();
    let mut views: Vec<View> = (others.iter().zip(&prepared).zip(&laid).enumerate())
        .filter_map(|(place, ((other, prepared), pose))| {
            Some(View::new(place, &figure, model, other, prepared, &fitted.pose, pose.clone()?))
        })
        .collect();
    if views.is_empty() {
        log.push("no other scan takes part in the shape".into());
        return FittedBody { elsewhere: laid, report: with_log(fitted, log), ..fitted.clone() };
    }

    let before = naked.residual_of(&fitted.pose, &fitted.shape);
    let mut found = Found { iterations: fitted.report.iterations, ..Found::at(fitted) };
    iterate(&naked, &mut views, &mut found, params, on_step);
    let index = naked.index_at(&found.pose, &found.shape);
    let after = naked.residual_of(&found.pose, &found.shape);
    let scans = views.len() + 1;
    let told = format!("one shape from {scans} scans: {}", change(&fitted.surface, &model.shaped(&found.shape).0));
    let refined = naked.conclude(found, &index, fitted.unseen.clone(), log.iter().cloned().chain([told]).collect());
    /// The others may cost the naked scan this much of its fit, in metres: a tenth of its noise.
    const COST: f64 = 2e-4;
    let contradicted = (after > before + COST).then(|| {
        format!("with all, the body lies {:.1} mm from it on average, {:.1} mm alone", after * 1e3, before * 1e3)
    });
    let why = match (contradicted, refined) {
        (None, Ok(refined)) => {
            let mut elsewhere = vec![None; others.len()];
            for view in views {
                elsewhere[view.place] = Some(view.pose);
            }
            return FittedBody { elsewhere, ..refined };
        }
        (Some(why), _) => why,
        (None, Err(error)) => error.to_string(),
    };
    log.push(format!("the other scans contradict the naked one: {why}; the body keeps its shape"));
    FittedBody { report: with_log(fitted, log), ..fitted.clone() }
}

fn with_log(fitted: &FittedBody, log: Vec<String>) -> FitReport {
    FitReport { log, ..fitted.report.clone() }
}

impl FittedBody {
    /// The body alone, as it was fitted; `model` is what was fitted.
    pub fn figure(&self, model: &BodyModel) -> Figure {
        Figure::bare(self.skeleton.clone(), self.surface.clone(), model.weights.clone())
    }
}

/// How the body stands in each of the scans, each from where it stood in the last.
fn laid_into_each(
    figure: &Figure,
    fitted: &FittedBody,
    others: &[OtherScan<'_>],
    model: &BodyModel,
    log: &mut Vec<String>,
) -> Vec<Option<Pose>> {
    let mut last = fitted.pose.clone();
    let mut lay = |other: &OtherScan<'_>| match fit_inside(
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
            log.push(format!("the scan '{}' takes no part in the shape: {error}", other.name));
            None
        }
    };
    others.iter().map(&mut lay).collect()
}

/// In words, how far a surface moved.
fn change(before: &TriMesh, after: &TriMesh) -> String {
    let areas = before.vertex_areas();
    let moves = || before.points().iter().zip(after.points().iter()).map(|(p, q)| (p - q).norm());
    let mean = moves().zip(areas.iter()).map(|(d, a)| d * a).sum::<f64>() / areas.iter().sum::<f64>().max(1e-12);
    let most = moves().fold(0.0, f64::max);
    format!("the body changed by {:.1} mm on average, {:.1} mm at most", mean * 1e3, most * 1e3)
}

/// Gauss–Newton steps until no joint of the naked scan moves.
fn iterate(
    naked: &naked::Solver,
    views: &mut [View],
    found: &mut Found,
    params: &NakedParams,
    on_step: &mut dyn FnMut(&Step),
) {
    let places = naked.places(params.samples);
    let mut index = naked.index.clone();
    let mut still = 0;
    for _ in 0..ITERATIONS {
        let posed = naked.body.posed(&found.pose, &found.shape);
        index.follow(&naked.mesh(&posed));
        let (mut equations, residual) = naked.equations(&FINEST, &places, &posed, &found.pose, &index);
        equations.freeze_all_but(&naked.unknowns(true));
        let mut parts = vec![equations];
        let seen: Vec<Posed> = views.iter_mut().map(|view| view.posed(&found.shape)).collect();
        parts.extend(views.iter().zip(&seen).map(|(view, posed)| view.equations(posed)));
        let Some(steps) = solve_together(&parts, &found.shape, params.shape_prior, 1e-4) else { break };

        let (pose, shape) = naked.body.stepped(&posed, &found.pose, &found.shape, &steps[0]);
        for ((view, posed), step) in views.iter_mut().zip(&seen).zip(&steps[1..]) {
            view.pose = view.solver.body.stepped(posed, &view.pose, &found.shape, step).0;
        }
        // Limbs that cloth hides may wander in their scans without any weight in the shape.
        let moved = naked.moved(&posed, &pose, &shape);
        (found.pose, found.shape) = (pose, shape);
        found.iterations += 1;
        on_step(&Step { iteration: found.iterations, moved, residual, surface: index.mesh() });
        still = if moved < naked::STILL { still + 1 } else { 0 };
        if still >= 2 {
            break;
        }
    }
    found.converged = still > 0;
}

/// Another scan, with the model laid into it.
struct View<'a> {
    /// Among the others.
    place: usize,
    solver: inside::Solver<'a>,
    model: &'a BodyModel,
    pose: Pose,
    /// Where the body lay at first: what cloth hides stays near it.
    center: Pose,
    index: SurfaceIndex,
    /// Places of skin that no cloth reaches, with their areas.
    skin: Vec<(VertexId, f64)>,
    scan: Vec<(VertexId, f64)>,
    near: LastFaces,
    areas: PerVertex<f64>,
}

impl<'a> View<'a> {
    /// Distance within which skin and scan are drawn together, metres.
    const REACH: f64 = 0.03;
    const LEAST_COSINE: f64 = 0.6;

    fn new(
        place: usize,
        figure: &'a Figure,
        model: &'a BodyModel,
        other: &'a OtherScan<'_>,
        (surface, dressed): &'a (ScanSurface, Dressed),
        before: &Pose,
        pose: Pose,
    ) -> Self {
        let mut solver = inside::Solver::new(figure, dressed, surface, &model.limits, &other.params);
        let unseen = solver.unseen_limbs(before, &pose);
        solver.leave_out(&unseen, &mut Vec::new());
        solver.body = Articulated::of_model(model);
        let areas = model.template.vertex_areas();
        let mut of_skin = areas.clone();
        of_skin.0.iter_mut().enumerate().for_each(|(i, area)| {
            *area = if solver.is_sure_skin(VertexId::from_index(i)) { *area } else { 0.0 };
        });
        let scan = surface.trusted_samples(other.params.samples);
        Self {
            place,
            model,
            center: pose.clone(),
            pose,
            index: SurfaceIndex::prepare(&model.template),
            skin: spread(&of_skin, other.params.samples),
            near: LastFaces::none(scan.len()),
            scan,
            areas,
            solver,
        }
    }

    /// Poses the model, and lets the index follow it.
    fn posed(&mut self, shape: &Shape) -> Posed {
        let posed = self.solver.body.posed(&self.pose, shape);
        self.index.follow(&self.model.template.with_points(posed.points.clone()));
        posed
    }

    fn equations(&self, posed: &Posed) -> NormalEquations {
        let solver = &self.solver;
        let normals = self.index.mesh().vertex_normals();
        let (reach, least_cosine) = (Self::REACH, Self::LEAST_COSINE);
        let mut residuals = solver.figure_to_scan(posed, &normals, &self.skin, reach, least_cosine);
        let takes = |corners: &[VertexId; 3]| corners.iter().all(|&v| solver.is_sure_skin(v));
        residuals.extend(scan_to_mesh_from(
            solver.surface,
            &self.index,
            &normals,
            (&self.scan, &self.near),
            reach,
            least_cosine,
            takes,
        ));
        let sides = solver.sides(posed, &normals);
        residuals.extend(sides.into_iter().enumerate().filter_map(|(i, side)| {
            let (v, side) = (VertexId::from_index(i), side?);
            let lack = side.clearance - solver.wanted_at(v);
            (lack < 0.0).then(|| Residual::on_vertex(v, side.normal, lack, robust(self.areas[v], -lack, reach)))
        }));
        let unknowns = Unknowns { joints: solver.held.iter().map(|held| !held).collect(), shape: true };
        let mut equations = solver.body.normal_equations(posed, &residuals, &unknowns);
        let stiffness = pose_stiffness(&solver.body.skeleton, solver.params.pose_prior);
        let prior =
            PosePrior { center: &self.center, stiffness: &stiffness, limits: &self.model.limits, limit_stiffness: 2e4 };
        equations.add_pose_prior(posed, &self.pose, &prior);
        equations.freeze_all_but(&unknowns);
        equations
    }
}

impl inside::Solver<'_> {
    fn is_sure_skin(&self, v: VertexId) -> bool {
        self.dressed.is_sure_skin(v) && !self.left_out[v]
    }
}
