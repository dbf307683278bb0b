//! The offset that each vertex still requires after the pose, and how far the skin has moved in total.

use super::problem::InsideProblem;
use crate::body::Pose;
use crate::fit::correspondence::{Sidedness, side_of};
use crate::fit::solver::Posed;
use crate::geometry::{PerVertex, Point, TriMesh, Vec3, VertexId};
use rayon::prelude::*;

/// The inward offset that a point requires to satisfy the margin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RequiredOffset {
    /// Along the body's normal, in metres; negative where the margin is satisfied.
    pub(crate) along_normal: f64,
    /// Clearance gained per offset: less than 1 where the scan is oblique to the body, as at a hem, which faces down.
    pub(crate) gain: f64,
}

impl RequiredOffset {
    pub(crate) fn of(margin: f64, side: &Sidedness) -> Self {
        Self { along_normal: (margin - side.clearance) / side.cosine, gain: side.cosine }
    }

    /// Violation of the margin in metres after skin has moved by `offset` along its normal.
    pub(crate) fn violation(&self, offset: f64) -> f64 {
        (self.along_normal + offset) * self.gain
    }
}

impl InsideProblem<'_> {
    /// The area of each body vertex that must stay inside; 0 for others, where the scan may be the skin itself.
    ///
    /// **Shapes** one area per vertex of the body.
    pub(crate) fn hidden_areas(&self, body: &TriMesh) -> PerVertex<f64> {
        let mut areas = body.vertex_areas();
        areas.0.iter_mut().enumerate().for_each(|(i, area)| {
            *area = if self.figure_surface.must_stay_inside(VertexId::from_index(i)) { *area } else { 0.0 };
        });
        areas
    }

    /// The offset that each constrained vertex requires. The centres of its hidden faces must satisfy the margin, too, because
    /// the edge of a scan fits between two vertices of a shin. **Shapes** one entry per vertex of the body.
    pub(crate) fn required_offsets(&self, posed: &Posed, body: &TriMesh) -> PerVertex<Option<RequiredOffset>> {
        let normals = self.normals(posed);
        let mut needed: PerVertex<Option<RequiredOffset>> = self
            .sides(posed, &normals)
            .into_iter()
            .enumerate()
            .map(|(i, side)| side.map(|s| RequiredOffset::of(self.full_margin(VertexId::from_index(i)), &s)))
            .collect();
        let of_faces: Vec<Option<RequiredOffset>> =
            body.faces().0.par_iter().map(|corners| self.required_offset_of_face(posed, &normals, *corners)).collect();
        for (corners, need) in body.faces().iter().zip(of_faces) {
            // A corner next to a hole of the scan follows the rest of its face.
            let Some(need) = need else { continue };
            let is_more = |own: Option<RequiredOffset>| need.along_normal > own.map_or(0.0, |own| own.along_normal);
            corners.iter().for_each(|&v| needed[v] = if is_more(needed[v]) { Some(need) } else { needed[v] });
        }
        needed
    }

    /// Mean distance between the skin in two poses, the second one with offsets, in the root's frame. Metres.
    pub(crate) fn proximity(&self, before: &Pose, after: &Pose, offsets: &PerVertex<f64>) -> f64 {
        let in_root_frame = |pose: &Pose, offsets: Option<&PerVertex<f64>>| -> Vec<Point> {
            let mesh = self.body_mesh(&self.posed(pose));
            let (normals, root) = (mesh.vertex_normals(), self.body.skeleton.world_from_bind(pose)[0].inverse());
            let by = |v: VertexId| offsets.map_or(Vec3::zeros(), |offsets| normals[v] * offsets[v]);
            mesh.points().enumerate().map(|(v, p)| root * (p + by(v))).collect()
        };
        let areas = self.bare.vertex_areas();
        let moved = in_root_frame(before, None).into_iter().zip(in_root_frame(after, Some(offsets)));
        let sum: f64 = moved.zip(areas.iter()).map(|((p, q), area)| (p - q).norm() * area).sum();
        sum / areas.iter().sum::<f64>().max(1e-12)
    }

    /// The offset that the centre of a face requires, if all of its corners are hidden.
    fn required_offset_of_face(
        &self,
        posed: &Posed,
        normals: &PerVertex<Vec3>,
        corners: [VertexId; 3],
    ) -> Option<RequiredOffset> {
        if !corners.iter().all(|&v| self.figure_surface.must_stay_inside(v) && !self.left_out[v]) {
            return None;
        }
        let [a, b, c] = corners.map(|v| posed.points[v].coords);
        let normal = corners.iter().map(|&v| normals[v]).sum::<Vec3>().try_normalize(1e-9)?;
        let side = side_of(self.surface, &((a + b + c) / 3.0).into(), &normal)?;
        let margin = corners.iter().map(|&v| self.full_margin(v)).fold(f64::INFINITY, f64::min);
        Some(RequiredOffset::of(margin, &side))
    }
}
