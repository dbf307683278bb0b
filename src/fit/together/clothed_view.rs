//! A clothed scan with the model posed in it: its part of the joint least-squares problem.

use super::other_scan::OtherScan;
use crate::body::{BodyModel, Figure, Pose, Shape};
use crate::fit::correspondence::{LastFaces, ScanSurface, scan_to_mesh_from, spread};
use crate::fit::inside::{FigureSurface, InsideProblem};
use crate::fit::solver::{Articulated, NormalEquations, PosePrior, Posed, Residual, Unknowns, pose_stiffness, robust};
use crate::geometry::{PerVertex, SurfaceIndex, VertexId};

/// A clothed scan with the model posed in it.
pub(crate) struct ClothedView<'a> {
    /// Index among the other scans.
    pub(crate) place: usize,
    pub(crate) problem: InsideProblem<'a>,
    model: &'a BodyModel,
    pub(crate) pose: Pose,
    /// The initial pose, which is the centre of the pose prior: what cloth hides stays near it.
    center: Pose,
    index: SurfaceIndex,
    /// Sample points of skin that no cloth reaches, with their areas.
    skin: Vec<(VertexId, f64)>,
    scan: Vec<(VertexId, f64)>,
    near: LastFaces,
    areas: PerVertex<f64>,
}

impl<'a> ClothedView<'a> {
    /// Greatest distance of a correspondence between skin and scan, in metres.
    const REACH: f64 = 0.03;
    const LEAST_COSINE: f64 = 0.6;

    pub(crate) fn new(
        place: usize,
        figure: &'a Figure,
        model: &'a BodyModel,
        other: &'a OtherScan<'_>,
        (surface, figure_surface): &'a (ScanSurface, FigureSurface),
        before: &Pose,
        pose: Pose,
    ) -> Self {
        let mut problem = InsideProblem::new(figure, figure_surface, surface, &model.limits, &other.params);
        let unseen = problem.unseen_limbs(before, &pose);
        problem.leave_out(&unseen, &mut Vec::new());
        problem.body = Articulated::of_model(model);
        let areas = model.template.vertex_areas();
        let mut of_skin = areas.clone();
        of_skin.0.iter_mut().enumerate().for_each(|(i, area)| {
            *area = if problem.is_certainly_skin(VertexId::from_index(i)) { *area } else { 0.0 };
        });
        let scan = surface.confidence_weighted_samples(other.params.samples);
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
            problem,
        }
    }

    /// Poses the model and updates the index.
    pub(crate) fn posed(&mut self, shape: &Shape) -> Posed {
        let posed = self.problem.body.posed(&self.pose, shape);
        self.index.follow(&self.model.template.with_points(posed.points.clone()));
        posed
    }

    pub(crate) fn equations(&self, posed: &Posed) -> NormalEquations {
        let problem = &self.problem;
        let normals = self.index.mesh().vertex_normals();
        let (reach, least_cosine) = (Self::REACH, Self::LEAST_COSINE);
        let mut residuals = problem.figure_to_scan(posed, &normals, &self.skin, reach, least_cosine);
        let takes = |corners: &[VertexId; 3]| corners.iter().all(|&v| problem.is_certainly_skin(v));
        residuals.extend(scan_to_mesh_from(
            problem.surface,
            &self.index,
            &normals,
            (&self.scan, &self.near),
            reach,
            least_cosine,
            takes,
        ));
        let sides = problem.sides(posed, &normals);
        residuals.extend(sides.into_iter().enumerate().filter_map(|(i, side)| {
            let (v, side) = (VertexId::from_index(i), side?);
            let gap = side.clearance - problem.pose_margin(v);
            (gap < 0.0).then(|| Residual::on_vertex(v, side.normal, gap, robust(self.areas[v], -gap, reach)))
        }));
        let unknowns = Unknowns { joints: problem.held.iter().map(|held| !held).collect(), shape: true };
        let mut equations = problem.body.normal_equations(posed, &residuals, &unknowns);
        let stiffness = pose_stiffness(&problem.body.skeleton, problem.params.pose_prior);
        let prior = PosePrior { center: &self.center, stiffness: &stiffness, limits: &self.model.limits };
        equations.add_pose_prior(posed, &self.pose, &prior);
        equations.freeze_all_but(&unknowns);
        equations
    }
}

impl InsideProblem<'_> {
    fn is_certainly_skin(&self, v: VertexId) -> bool {
        self.figure_surface.is_certainly_skin(v) && !self.left_out[v]
    }
}
