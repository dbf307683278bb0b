//! The least-squares problem of a naked fit: the body model, the scan, and the residuals between them.

use super::hair::Hair;
use super::params::NakedParams;
use crate::body::{BodyModel, JointId, Pose, Shape};
use crate::fit::correspondence::{
    JointSubtree, LastFaces, ScanSurface, mean_truncated, mesh_to_scan_from, parts, scan_to_mesh_from, spread,
};
use crate::fit::solver::{
    Articulated, JointGroup, NormalEquations, Phase, PosePrior, Posed, Unknowns, held_joints, mean_residual,
    pose_stiffness,
};
use crate::geometry::{PerVertex, SurfaceIndex, TriMesh, VertexId};

/// The gates of the last iterations, when nearly all correspondences are right.
pub(crate) const FINEST: Phase =
    Phase { iterations: 30, samples: 6000, reach: 0.035, least_cosine: 0.6, limbs_only: false, shape: true };

/// A step is still if it moves every joint by less than this, in metres: far below the scan's noise.
pub(crate) const STILL: f64 = 3e-4;

/// Sample points of model and scan in an iteration, each with the area that it represents.
pub(crate) struct SamplePlaces {
    model: Vec<(VertexId, f64)>,
    scan: Vec<(VertexId, f64)>,
    near_model: LastFaces,
    near_scan: LastFaces,
}

/// Body model and scan with what takes part in the fit.
pub(crate) struct NakedProblem<'a> {
    pub(crate) body: Articulated<'a>,
    pub(crate) model: &'a BodyModel,
    pub(crate) surface: &'a ScanSurface,
    pub(super) params: &'a NakedParams,
    pub(super) parts: Vec<JointSubtree>,
    /// Bounding volume hierarchy of the model in the bind pose, which follows the poses.
    pub(crate) index: SurfaceIndex,
    /// Joints that keep their pose: fingers, and those of limbs that the scan does not show. **Shapes** one entry per joint.
    held: Vec<bool>,
    /// Vertices that take no part, because the scan does not show them. **Shapes** one entry per vertex.
    pub(super) left_out: PerVertex<bool>,
    /// Centre of the pose prior.
    center: Pose,
    /// Hair that the surface does not contain because it was removed.
    pub(crate) hair: Option<Hair>,
}

impl<'a> NakedProblem<'a> {
    /// `index` holds the model in the bind pose.
    pub(crate) fn prepare(
        model: &'a BodyModel,
        index: SurfaceIndex,
        surface: &'a ScanSurface,
        params: &'a NakedParams,
    ) -> Self {
        let body = Articulated::of_model(model);
        let joints = body.joint_count();
        Self {
            parts: parts(&model.skeleton, &model.weights),
            index,
            held: held_joints(&model.skeleton, JointGroup::All),
            left_out: PerVertex::filled(false, model.template.vertex_count()),
            center: Pose::bind(joints),
            hair: None,
            body,
            model,
            surface,
            params,
        }
    }

    pub(crate) fn index_at(&self, pose: &Pose, shape: &Shape) -> SurfaceIndex {
        let mut index = self.index.clone();
        index.follow(&self.mesh(&self.body.posed(pose, shape)));
        index
    }

    pub(crate) fn mesh(&self, posed: &Posed) -> TriMesh {
        self.model.template.with_points(posed.points.clone())
    }

    /// Excludes limbs from the fit: they keep their pose and their vertices take no part.
    pub(crate) fn leave_out(&mut self, unseen: &[JointId]) {
        let skeleton = &self.model.skeleton;
        for &joint in unseen {
            for (held, j) in self.held.iter_mut().zip(skeleton.ids()) {
                *held |= skeleton.is_below(j, joint);
            }
            if let Some(part) = self.parts.iter().find(|p| p.joint == joint) {
                for (out, belongs) in self.left_out.0.iter_mut().zip(part.vertices.iter()) {
                    *out |= belongs;
                }
            }
        }
    }

    pub(crate) fn unknowns(&self, shape: bool) -> Unknowns {
        Unknowns { joints: self.held.iter().map(|held| !held).collect(), shape }
    }

    /// About `count` sample points on the part of the model that takes part, and on the scan.
    pub(crate) fn places(&self, count: usize) -> SamplePlaces {
        let mut areas = self.model.template.vertex_areas();
        for (area, out) in areas.0.iter_mut().zip(self.left_out.iter()) {
            *area = if *out { 0.0 } else { *area };
        }
        let (model, scan) = (spread(&areas, count), self.surface.confidence_weighted_samples(count));
        let (near_model, near_scan) = (LastFaces::none(model.len()), LastFaces::none(scan.len()));
        SamplePlaces { model, scan, near_model, near_scan }
    }

    /// The normal equations of a step without the shape prior, and the weighted mean of the residuals. `index` holds `posed`.
    pub(crate) fn equations(
        &self,
        phase: &Phase,
        places: &SamplePlaces,
        posed: &Posed,
        pose: &Pose,
        index: &SurfaceIndex,
    ) -> (NormalEquations, f64) {
        let normals = index.mesh().vertex_normals_by_area();
        let takes = |corners: &[VertexId; 3]| corners.iter().all(|&v| !self.left_out[v]);
        let (reach, least_cosine) = (phase.reach, phase.least_cosine);
        let of_model = (places.model.as_slice(), &places.near_model);
        let mut residuals = mesh_to_scan_from(self.surface, &posed.points, &normals, of_model, reach, least_cosine);
        let of_scan = (places.scan.as_slice(), &places.near_scan);
        residuals.extend(scan_to_mesh_from(self.surface, index, &normals, of_scan, reach, least_cosine, takes));
        let mut equations = self.body.normal_equations(posed, &residuals, &self.unknowns(phase.shape));
        let stiffness = pose_stiffness(&self.body.skeleton, self.params.pose_prior);
        let prior = PosePrior { center: &self.center, stiffness: &stiffness, limits: &self.model.limits };
        equations.add_pose_prior(posed, pose, &prior);
        (equations, mean_residual(&residuals))
    }

    pub(crate) fn moved(&self, posed: &Posed, pose: &Pose, shape: &Shape) -> f64 {
        let after = self.model.skeleton_of(shape).joints_in_world(pose);
        self.body.greatest_move(posed, &after)
    }

    /// Mean truncated distance both ways: comparable between poses whatever their correspondences.
    pub(crate) fn score(&self, pose: &Pose, shape: &Shape) -> f64 {
        /// Truncation in metres: an arm that points in another direction counts as this far.
        const TRUNCATE: f64 = 0.15;
        let mesh = self.mesh(&self.body.posed(pose, shape));
        let there = || mean_truncated(&self.surface.index, &mesh, &mesh.vertex_areas(), TRUNCATE);
        let back = || {
            let mut index = self.index.clone();
            index.follow(&mesh);
            mean_truncated(&index, self.surface.mesh(), &self.surface.areas, TRUNCATE)
        };
        let (there, back) = rayon::join(there, back);
        0.5 * (there + back)
    }
}
