//! The least-squares problem of a fit inside a scan: the figure, the scan, the residuals between them, and sidedness.

use super::cover::Cover;
use super::figure_surface::{FigureSurface, GREATEST_EXTENSION, UNCERTAIN_LIMIT};
use super::params::{InsideMethod, InsideParams};
use crate::body::{Figure, JointLimits, Pose, Shape};
use crate::fit::correspondence::{ScanSurface, Sidedness, mean_and_p95, scan_to_mesh, side_of, spread};
use crate::fit::solver::{Articulated, PosePrior, Posed, Residual, held_joints, pose_stiffness, robust};
use crate::geometry::{PerVertex, SurfaceIndex, TriMesh, Vec3, VertexId};
use rayon::prelude::*;

/// Figure and scan with what takes part in the fit.
pub(crate) struct InsideProblem<'a> {
    pub(crate) body: Articulated<'a>,
    /// The body's surface in the bind pose.
    pub(crate) bare: &'a TriMesh,
    pub(crate) figure_surface: &'a FigureSurface,
    pub(crate) surface: &'a ScanSurface,
    limits: &'a [JointLimits],
    pub(crate) params: &'a InsideParams,
    /// Joints that keep the initial pose. **Shapes** one entry per joint.
    pub(crate) held: Vec<bool>,
    /// Vertices that take no part, because the scan does not show them. **Shapes** one entry per vertex.
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

    /// Stiffness of the prior toward the previous step's pose: greater where wide cloth hides what a joint moves, because then
    /// only the ends of a limb determine its middle. **Shapes** one value per joint.
    pub(crate) fn stiffness(&self) -> Vec<f64> {
        /// Factor of the stiffness. In a wide sleeve the fit moved an elbow that had not moved by 9 mm, for 4 mm of error at
        /// the hand. This factor halved that, with the same joint error on 20 synthetic people in wide clothes.
        const HIDDEN: f64 = 4.0;
        let of_skeleton = pose_stiffness(&self.body.skeleton, self.params.pose_prior);
        if self.params.method == InsideMethod::Hybrid {
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
            InsideMethod::Hybrid => 0.0,
            _ => self.margin_for_pose(v) - self.params.give,
        }
    }

    /// The side of each body vertex that must stay inside and that the scan shows. **Shapes** one entry per vertex of the body.
    pub(crate) fn sides(&self, posed: &Posed, normals: &PerVertex<Vec3>) -> Vec<Option<Sidedness>> {
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

    /// The margin, increased per inner layer: each is cloth between the skin and what the scan shows.
    pub(crate) fn full_margin(&self, v: VertexId) -> f64 {
        if self.figure_surface.may_be_covered(v) {
            return self.params.margin;
        }
        self.params.margin + self.params.thickness * self.figure_surface.layers_over[v]
    }

    /// The margin that a pose must satisfy: less near places where skin may be visible. There the scan may be the noisy skin
    /// itself, and only the bounded offset satisfies the whole margin.
    fn margin_for_pose(&self, v: VertexId) -> f64 {
        /// Noise of the scan plus the error of the registered surface, where both are the same skin. Metres.
        const TOLERANCE: f64 = 0.006;
        let depth = match self.figure_surface.may_be_covered(v) {
            true => 0.0,
            false => (self.figure_surface.depth_under_cover[v] / UNCERTAIN_LIMIT).min(1.0),
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

    /// About `count` sample points that are data: visible ones, and those under close cloth. Loose cloth is a constraint but no
    /// data: attraction to it (evenly around arms, or on shoulders) was tried on a coat and moved the arms away from the truth.
    pub(crate) fn samples(&self, count: usize) -> Vec<(VertexId, f64)> {
        let mut areas = self.data_areas();
        areas.0.iter_mut().zip(self.left_out.iter()).filter(|(_, out)| **out).for_each(|(a, _)| *a = 0.0);
        spread(&areas, count)
    }

    /// The area of each vertex times its weight as data. **Shapes** one value per vertex.
    pub(crate) fn data_areas(&self) -> PerVertex<f64> {
        let mut areas = self.figure_surface.mesh_in_bind.vertex_areas();
        for (i, a) in areas.0.iter_mut().enumerate() {
            let v = VertexId::from_index(i);
            let is_data = self.params.method == InsideMethod::Hybrid || self.figure_surface.cover[v] != Cover::Loose;
            *a *= if self.figure_surface.hidden[v] || !is_data { 0.0 } else { self.inlier_weight(v) };
        }
        areas
    }

    fn inlier_weight(&self, v: VertexId) -> f64 {
        let counts_fully = self.params.method == InsideMethod::Hybrid || !self.params.method.is_weighted();
        if counts_fully { 1.0 } else { self.figure_surface.inlier_weight[v] }
    }

    pub(crate) fn figure_to_scan(
        &self,
        posed: &Posed,
        normals: &PerVertex<Vec3>,
        samples: &[(VertexId, f64)],
        reach: f64,
        least_cosine: f64,
    ) -> Vec<Residual> {
        /// Close cloth within this distance does not attract. Metres: ease of 5 cm in girth.
        const CLOSE_CLOTH: f64 = 0.008;
        /// Weight of close cloth relative to visible skin.
        const TIGHT_WEIGHT: f64 = 0.1;
        let is_weighted = self.params.method.is_weighted();
        samples
            .par_iter()
            .filter_map(|&(v, area)| {
                let p = posed.points[v];
                let hit = self.surface.nearest(&p, reach)?;
                if hit.at_rim || hit.normal.dot(&normals[v]) < least_cosine {
                    return None;
                }
                let gap = hit.normal.dot(&(hit.point - p));
                let confidence = if is_weighted { hit.confidence } else { 1.0 };
                let weight = confidence * robust(area, hit.distance, reach);
                match self.figure_surface.cover[v] {
                    _ if self.params.method == InsideMethod::Hybrid => {
                        Some(Residual::on_vertex(v, hit.normal, gap, weight))
                    }
                    // Next to the cloth the scan may be skin or a hem: it certainly is not further in.
                    Cover::Bare if gap > 0.0 && is_weighted => {
                        let sure = TIGHT_WEIGHT
                            + (1.0 - TIGHT_WEIGHT) * self.figure_surface.distance_from_cover[v] / GREATEST_EXTENSION;
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
        let is_plain = self.params.method == InsideMethod::Hybrid;
        let takes = |corners: &[VertexId; 3]| {
            // On hanging cloth the closest point is as good as any other.
            let is_data = |c: VertexId| self.figure_surface.is_visible(c) && self.inlier_weight(c) > 0.5;
            corners.iter().all(|&c| !self.left_out[c] && (is_data(c) || (is_plain && !self.figure_surface.hidden[c])))
        };
        scan_to_mesh(self.surface, posed, normals, samples, reach, least_cosine, takes)
    }

    /// Mean truncated distance of the visible surface to the scan.
    pub(crate) fn score(&self, pose: &Pose) -> f64 {
        self.visible_distances(&self.posed(pose)).0
    }

    /// Mean and 95th percentile of the truncated distance of the visible surface to the scan.
    pub(crate) fn visible_distances(&self, posed: &Posed) -> (f64, f64) {
        /// Truncation in metres: an arm that points in another direction counts as this far.
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
