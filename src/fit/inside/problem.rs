//! The least-squares problem of a fit inside a scan: the figure, the scan, what draws one to the other, and sides.

use super::cover::Cover;
use super::figure_surface::{FigureSurface, MAY_REACH, UNSURE};
use super::params::{InsideMethod, InsideParams};
use crate::body::{Figure, JointLimits, Pose, Shape};
use crate::fit::correspondence::{ScanSurface, Side, mean_and_p95, scan_to_mesh, side_of, spread};
use crate::fit::solver::{Articulated, PosePrior, Posed, Residual, held_joints, pose_stiffness, robust};
use crate::geometry::{PerVertex, SurfaceIndex, TriMesh, Vec3, VertexId};
use rayon::prelude::*;

pub(crate) struct InsideProblem<'a> {
    pub(crate) body: Articulated<'a>,
    /// The body's surface in the bind pose.
    pub(crate) bare: &'a TriMesh,
    pub(crate) figure_surface: &'a FigureSurface,
    pub(crate) surface: &'a ScanSurface,
    limits: &'a [JointLimits],
    pub(crate) params: &'a InsideParams,
    /// Joints that keep the pose of the start.
    pub(crate) held: Vec<bool>,
    /// Vertices that take no part, for the scan does not show them.
    pub(crate) left_out: PerVertex<bool>,
}

impl<'a> InsideProblem<'a> {
    pub(crate) fn new(
        figure: &'a Figure,
        figure_surface: &'a FigureSurface,
        surface: &'a ScanSurface,
        limits: &'a [JointLimits],
        params: &'a InsideParams,
    ) -> Self {
        let held = held_joints(&figure.skeleton, params.joints);
        let bare = &figure.body().mesh;
        let left_out = PerVertex::filled(false, figure_surface.mesh_in_bind.vertex_count());
        Self { body: figure_surface.articulated(figure), bare, figure_surface, surface, limits, params, held, left_out }
    }

    pub(crate) fn posed(&self, pose: &Pose) -> Posed {
        self.body.posed(pose, &Shape(Vec::new()))
    }

    /// How strongly each joint is drawn to the step before: more where wide cloth hides what it moves, for then nothing but
    /// the ends of a limb says where its middle is.
    pub(crate) fn stiffness(&self) -> Vec<f64> {
        /// In a wide sleeve an elbow was moved by 9 mm that had moved by none, for 4 mm of error at the hand. So many times
        /// the pull halved that; on 20 invented people in wide clothes joints lay as near to the truth as before.
        const HIDDEN: f64 = 4.0;
        let of_skeleton = pose_stiffness(&self.body.skeleton, self.params.pose_prior);
        if self.params.method == InsideMethod::Paper {
            return of_skeleton;
        }
        let hidden = self.figure_surface.loose_shares(self.bare, self.body.joint_count());
        of_skeleton.into_iter().zip(hidden).map(|(s, share)| s * (1.0 + (HIDDEN - 1.0) * share)).collect()
    }

    pub(crate) fn prior<'b>(&'b self, center: &'b Pose, stiffness: &'b [f64]) -> PosePrior<'b> {
        PosePrior { center, stiffness, limits: self.limits }
    }

    /// How far inside each hidden vertex must be after a step, before the offset.
    pub(crate) fn pose_margin(&self, v: VertexId) -> f64 {
        match self.params.method {
            InsideMethod::Robust => self.margin_for_pose(v) - self.params.give,
            InsideMethod::Paper => 0.0,
        }
    }

    /// For each body vertex that must stay inside and that the scan saw, where it lies.
    pub(crate) fn sides(&self, posed: &Posed, normals: &PerVertex<Vec3>) -> Vec<Option<Side>> {
        (0..self.figure_surface.body_count)
            .into_par_iter()
            .map(|i| {
                let v = VertexId::from_index(i);
                if self.left_out[v]
                    || !(self.figure_surface.must_stay_inside(v) || self.figure_surface.may_be_covered(v))
                {
                    return None;
                }
                side_of(self.surface, &posed.points[v], &normals[v])
            })
            .collect()
    }

    /// The margin where a vertex lies under inner layers too: each is cloth between the skin and what is observed.
    pub(crate) fn full_margin(&self, v: VertexId) -> f64 {
        if self.figure_surface.may_be_covered(v) {
            return self.params.margin;
        }
        self.params.margin + self.params.thickness * self.figure_surface.layers_over[v]
    }

    /// What a pose must keep: the margin, less near places where skin may show. There the scan may be the skin itself,
    /// noise and all, and only the bounded offset holds the whole margin.
    fn margin_for_pose(&self, v: VertexId) -> f64 {
        /// Noise of the scan plus the error of the registered surface, where both are the same skin. Metres.
        const TOLERANCE: f64 = 0.006;
        let depth = match self.figure_surface.may_be_covered(v) {
            true => 0.0,
            false => (self.figure_surface.depth_under_cover[v] / UNSURE).min(1.0),
        };
        self.full_margin(v) - TOLERANCE * (1.0 - depth)
    }

    pub(crate) fn mesh(&self, posed: &Posed) -> TriMesh {
        self.figure_surface.mesh_in_bind.with_points(posed.points.clone())
    }

    pub(crate) fn normals(&self, posed: &Posed) -> PerVertex<Vec3> {
        self.mesh(posed).vertex_normals()
    }

    /// The body's surface.
    pub(crate) fn body_mesh(&self, posed: &Posed) -> TriMesh {
        self.bare.with_points(PerVertex(posed.points.0[..self.figure_surface.body_count].to_vec()))
    }

    /// Vertices that take part as data: shown ones, and those under cloth that lies close. Loose cloth is a wall, no
    /// data: pulls toward it (evenly around arms, or where it should rest on shoulders) were tried on a coat and moved the
    /// arms away from their truth.
    pub(crate) fn samples(&self, count: usize) -> Vec<(VertexId, f64)> {
        let mut areas = self.data_areas();
        areas.0.iter_mut().zip(self.left_out.iter()).filter(|(_, out)| **out).for_each(|(a, _)| *a = 0.0);
        spread(&areas, count)
    }

    /// The area of each vertex, as far as it says anything of the pose where the scan shows it.
    pub(crate) fn data_areas(&self) -> PerVertex<f64> {
        let mut areas = self.figure_surface.mesh_in_bind.vertex_areas();
        for (i, a) in areas.0.iter_mut().enumerate() {
            let v = VertexId::from_index(i);
            let is_data = self.params.method == InsideMethod::Paper || self.figure_surface.cover[v] != Cover::Loose;
            *a *= if self.figure_surface.hidden[v] || !is_data { 0.0 } else { self.inlier_weight(v) };
        }
        areas
    }

    fn inlier_weight(&self, v: VertexId) -> f64 {
        if self.params.method == InsideMethod::Paper { 1.0 } else { self.figure_surface.inlier_weight[v] }
    }

    pub(crate) fn figure_to_scan(
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
                let weight = hit.confidence * robust(area, hit.distance, reach);
                match self.figure_surface.cover[v] {
                    _ if self.params.method == InsideMethod::Paper => {
                        Some(Residual::on_vertex(v, hit.normal, gap, weight))
                    }
                    // Beside the cloth the scan may be skin or a hem: it is sure only that it is not further in.
                    Cover::Bare if gap > 0.0 => {
                        let sure = TIGHT_WEIGHT
                            + (1.0 - TIGHT_WEIGHT) * self.figure_surface.distance_from_cover[v] / MAY_REACH;
                        Some(Residual::on_vertex(v, hit.normal, gap, weight * sure))
                    }
                    Cover::Bare => Some(Residual::on_vertex(v, hit.normal, gap, weight)),
                    _ => (gap > CLOSE_CLOTH)
                        .then(|| Residual::on_vertex(v, hit.normal, gap - CLOSE_CLOTH, weight * TIGHT_WEIGHT)),
                }
            })
            .collect()
    }

    pub(crate) fn scan_to_figure(
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
            let is_telling = |c: VertexId| self.figure_surface.is_visible(c) && self.inlier_weight(c) > 0.5;
            corners
                .iter()
                .all(|&c| !self.left_out[c] && (is_telling(c) || (is_plain && !self.figure_surface.hidden[c])))
        };
        scan_to_mesh(self.surface, posed, normals, samples, reach, least_cosine, takes)
    }

    /// Mean truncated distance of shown surface to the scan.
    pub(crate) fn score(&self, pose: &Pose) -> f64 {
        self.visible_distances(&self.posed(pose)).0
    }

    /// Mean and 95th percentile of the distance of shown surface to the scan, truncated.
    pub(crate) fn visible_distances(&self, posed: &Posed) -> (f64, f64) {
        /// An arm that points elsewhere counts as this far. Metres.
        const TRUNCATE: f64 = 0.15;
        let normals = self.normals(posed);
        let distances: Vec<f64> = self
            .samples(self.params.samples / 2)
            .into_par_iter()
            .filter(|&(v, _)| self.figure_surface.is_visible(v))
            .filter_map(|(v, _)| match self.surface.nearest(&posed.points[v], TRUNCATE) {
                Some(hit) if hit.at_rim => None,
                Some(hit) if hit.normal.dot(&normals[v]) > 0.0 => Some(hit.distance),
                _ => Some(TRUNCATE),
            })
            .collect();
        mean_and_p95(distances)
    }
}
