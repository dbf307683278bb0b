//! Agreement of a figure and a scan.

use super::cover::Cover;
use super::problem::InsideProblem;
use crate::body::JointId;
use crate::fit::correspondence::{dominant_joint, of_legs, spread};
use crate::fit::solver::Posed;
use crate::geometry::{NearestVertex, PerFace, Point, SurfaceIndex, VertexId};
use rayon::prelude::*;

/// The root of every skeleton.
const HIPS: JointId = JointId(0);

/// Agreement of a figure and a scan.
pub(crate) struct InsideAgreement {
    /// Area share of the scan that lies on the figure, or within the stand-off of its cloth.
    pub(crate) explained: f64,
    /// Area share of the figure's visible surface that lies on the scan.
    pub(crate) seen: f64,
    /// The part that is nearest to most of the unexplained scan.
    pub(super) near: Option<String>,
}

impl InsideAgreement {
    /// One sentence if part of the scan is unexplained.
    pub(crate) fn summary(&self) -> Option<String> {
        /// Smaller unexplained shares of the scan are not reported.
        const LEAST_REPORTED: f64 = 0.02;
        let rest = 1.0 - self.explained;
        let near = self.near.as_ref().filter(|_| rest > LEAST_REPORTED)?;
        Some(format!("{:.0} % of the scan's surface is far from the figure, most of it at the {near}", rest * 100.0))
    }
}

impl InsideProblem<'_> {
    /// Agreement of a figure and a scan.
    pub(crate) fn agreement(&self, posed: &Posed) -> InsideAgreement {
        /// Visible skin and inner cloth are within this distance of the scan, in metres: a collar may shift by as much.
        const VISIBLE: f64 = 0.03;
        /// Skin is within this distance of the scan: registration error, bent joints and hair. Metres.
        const SKIN: f64 = 0.04;
        /// Greatest stand-off in metres of wide cloth on hips and legs (a skirt's hem), of other wide cloth, of close cloth, and of
        /// inner cloth from its earlier place. With hands on the hips, elbows are 0.15 from the trunk.
        const CLOTH: [f64; 4] = [0.15, 0.08, 0.06, 0.1];
        const SAMPLES: usize = 4000;
        // A limb that was left out explains nothing: scan next to it is that limb in another pose.
        let mesh = self.mesh(posed);
        let takes_part: PerFace<bool> = mesh.faces().iter().map(|f| !f.iter().any(|&v| self.left_out[v])).collect();
        let (part, whole_from_part) = mesh.part(&takes_part);
        let index = SurfaceIndex::prepare(&part);
        let is_garment = |v: VertexId| v.index() >= self.figure_surface.body_count;
        let is_leg = of_legs(&self.body.skeleton);
        let hangs = |v: VertexId| {
            let joint = self.body.weights.rows()[v][0].0;
            joint == HIPS || is_leg(joint)
        };
        let is_loose = |v: VertexId| self.figure_surface.cover[v] == Cover::Loose;
        let around = [
            self.places(posed, |v| is_loose(v) && hangs(v)),
            self.places(posed, |v| is_loose(v) && !hangs(v)),
            self.places(posed, |v| self.figure_surface.cover[v] == Cover::Tight),
            self.places(posed, |v| is_garment(v) && self.figure_surface.cover[v] == Cover::Bare),
        ];
        let places = self.surface.samples(SAMPLES);
        let of_scan: Vec<(f64, Option<VertexId>)> = places
            .par_iter()
            .map(|&(v, area)| {
                let p = &self.surface.mesh().points()[v];
                let at = index.closest(p);
                let is_cloth = || around.iter().zip(CLOTH).any(|(on, far)| on.nearest(p).is_some_and(|n| n.1 < far));
                (area, (at.distance > SKIN && !is_cloth()).then(|| whole_from_part[at.nearest_corner(index.mesh())]))
            })
            .collect();
        let normals = self.normals(posed);
        // A limb that was left out should be visible, too.
        let visible_samples: Vec<(VertexId, f64)> = spread(&self.data_areas(), SAMPLES)
            .into_iter()
            .filter(|&(v, _)| self.figure_surface.is_visible(v))
            .collect();
        let of_figure: Vec<(f64, bool)> = visible_samples
            .par_iter()
            .map(|&(v, area)| {
                let hit = self.surface.nearest(&posed.points[v], VISIBLE);
                (area, hit.is_some_and(|hit| hit.at_rim || hit.normal.dot(&normals[v]) > 0.0))
            })
            .collect();
        let beside = of_scan.iter().filter_map(|&(area, v)| Some((v?, area)));
        let most = dominant_joint(beside, self.body.weights, &self.body.skeleton);
        InsideAgreement {
            explained: share(of_scan.iter().map(|s| (s.0, s.1.is_none()))),
            seen: share(of_figure.into_iter()),
            near: most.map(|joint| self.body.skeleton.part_name(joint)),
        }
    }

    /// The vertices that `count` accepts, for queries of the nearest one.
    fn places(&self, posed: &Posed, count: impl Fn(VertexId) -> bool) -> NearestVertex {
        let places: Vec<Point> =
            posed.points.enumerate().filter(|(v, _)| count(*v) && !self.left_out[*v]).map(|(_, p)| *p).collect();
        NearestVertex::prepare(&places)
    }
}

/// The area share for which the flag is true; 1 without any area.
fn share(parts: impl Iterator<Item = (f64, bool)>) -> f64 {
    let (good, total) =
        parts.fold((0.0, 0.0), |(good, total), (area, holds)| (good + if holds { area } else { 0.0 }, total + area));
    if total > 0.0 { good / total } else { 1.0 }
}
