//! Whether a figure and a scan belong together: limbs that are not seen, scan that is no part of the figure, skin that
//! stays outside.

use super::articulated::Posed;
use super::inside::{Solver, seen_from_root};
use super::inside_params::InsideMethod;
use super::lack::Lack;
use super::limbs::{self, Part, spoken};
use super::side::side_of;
use super::surface::spread;
use super::{Cover, FitError};
use crate::body::{JointId, Pose};
use crate::geometry::{NearestVertex, PerFace, PerVertex, Point, SurfaceIndex, TriMesh, VertexId};
use rayon::prelude::*;

/// The root of every skeleton.
const HIPS: JointId = JointId(0);

/// How much figure and scan have in common.
pub(super) struct Agreement {
    /// Area share of the scan that lies on the figure, or as far from it as cloth may.
    pub(super) explained: f64,
    /// Area share of what should show of the figure that lies on the scan.
    pub(super) seen: f64,
    /// The part beside which most of the rest is.
    near: Option<String>,
}

impl Agreement {
    /// A sentence where the scan shows more than the figure.
    pub(super) fn told(&self) -> Option<String> {
        /// A share of the scan that is worth a word.
        const WORTH_SAYING: f64 = 0.02;
        let rest = 1.0 - self.explained;
        let near = self.near.as_ref().filter(|_| rest > WORTH_SAYING)?;
        Some(format!("{:.0} % of the scan's surface is far from the figure, most of it at the {near}", rest * 100.0))
    }
}

impl Solver<'_> {
    /// The body's surface.
    pub(super) fn body_mesh(&self, posed: &Posed) -> TriMesh {
        self.bare.with_points(PerVertex(posed.points.0[..self.dressed.body_count].to_vec()))
    }

    /// Limbs of which the scan shows next to nothing, neither skin nor cloth around them.
    pub(super) fn unseen_limbs(&self, previous: &Pose, pose: &Pose) -> Vec<JointId> {
        /// A limb whose end has moved by this much, in metres, must be seen by more than half: an arm that fled into a coat's
        /// trunk has cloth around half of it.
        const FAR: f64 = 0.15;
        const LEAST_WHERE_MOVED: f64 = 0.7;
        if self.params.method == InsideMethod::Paper {
            return Vec::new();
        }
        let skeleton = &self.body.skeleton;
        let parts = limbs::parts(skeleton, self.body.weights);
        let shares = self.seen_shares(&parts, &self.posed(pose));
        let mut unseen = limbs::too_little(&parts, &shares, skeleton);

        for (part, share) in parts.iter().zip(&shares) {
            let is_new = !unseen.iter().any(|&u| skeleton.is_below(part.joint, u));
            if is_new && *share < LEAST_WHERE_MOVED && self.end_moved(part.joint, previous, pose) > FAR {
                unseen.push(part.joint);
            }
        }
        unseen
    }

    /// A sentence where the scan lacks the head, without which all the rest is fitted as well.
    pub(super) fn unseen_head(&self, posed: &Posed) -> Option<&'static str> {
        let head = limbs::parts_named(&["head"], &self.body.skeleton, self.body.weights);
        let unseen = limbs::too_little(&head, &self.seen_shares(&head, posed), &self.body.skeleton);
        (!unseen.is_empty()).then_some("the scan does not show the head")
    }

    /// Of each part the share of which the scan shows skin, or cloth around it.
    fn seen_shares(&self, parts: &[Part], posed: &Posed) -> Vec<f64> {
        let normals = self.normals(posed);
        let index = SurfaceIndex::prepare(&self.body_mesh(posed));
        limbs::seen_shares(&index, parts, |v, p| match self.dressed.is_shown(v) {
            true => limbs::shown_at(self.surface, p, &normals[v]),
            false => side_of(self.surface, p, &normals[v]).map(|side| side.place),
        })
    }

    /// How far the joints from `limb` on have moved, at most, as seen from the root: metres.
    fn end_moved(&self, limb: JointId, previous: &Pose, pose: &Pose) -> f64 {
        let skeleton = &self.body.skeleton;
        let (before, after) = (seen_from_root(skeleton, previous), seen_from_root(skeleton, pose));
        let below = skeleton.ids().filter(|&j| skeleton.is_below(j, limb));
        below.map(|j| (before[j.index()] - after[j.index()]).norm()).fold(0.0, f64::max)
    }

    /// Takes limbs out of the fit: they hang as before.
    pub(super) fn leave_out(&mut self, limbs: &[JointId], log: &mut Vec<String>) {
        let skeleton = &self.body.skeleton;
        for &limb in limbs {
            let name = spoken(&skeleton.names[limb.index()]);
            log.push(format!("the scan does not show the {name}; it keeps the pose of the step before"));
            for (held, j) in self.held.iter_mut().zip(skeleton.ids()) {
                *held |= skeleton.is_below(j, limb);
            }
        }
        let names: Vec<&str> = limbs.iter().map(|limb| skeleton.names[limb.index()].as_str()).collect();
        for part in limbs::parts_named(&names, skeleton, self.body.weights) {
            self.left_out.0.iter_mut().zip(part.vertices.iter()).for_each(|(out, belongs)| *out |= belongs);
        }
    }

    /// How much figure and scan have in common.
    pub(super) fn agreement(&self, posed: &Posed) -> Agreement {
        /// Shown skin and cloth of the last step lie within this of the scan, metres: a collar may shift by as much.
        const SHOWN: f64 = 0.03;
        /// What a registered body, the bend of a joint, and hair leave. Metres.
        const SKIN: f64 = 0.04;
        /// Cloth may stand off by this, in metres: wide cloth that hangs from hips and legs (a skirt's hem) and wide cloth
        /// elsewhere, close cloth, and worn cloth from where it was. Elbows of hands on hips are 0.15 from the trunk.
        const CLOTH: [f64; 4] = [0.15, 0.08, 0.06, 0.1];
        const SAMPLES: usize = 4000;
        // A limb that was left out explains nothing: scan beside it is that limb, elsewhere.
        let mesh = self.mesh(posed);
        let takes_part: PerFace<bool> = mesh.faces().iter().map(|f| !f.iter().any(|&v| self.left_out[v])).collect();
        let (part, whole_from_part) = mesh.part(&takes_part);
        let index = SurfaceIndex::prepare(&part);
        let is_worn = |v: VertexId| v.index() >= self.dressed.body_count;
        let is_leg = limbs::of_legs(&self.body.skeleton);
        let hangs = |v: VertexId| {
            let joint = self.body.weights.rows()[v][0].0;
            joint == HIPS || is_leg(joint)
        };
        let is_loose = |v: VertexId| self.dressed.cover[v] == Cover::Loose;
        let around = [
            self.places(posed, |v| is_loose(v) && hangs(v)),
            self.places(posed, |v| is_loose(v) && !hangs(v)),
            self.places(posed, |v| self.dressed.cover[v] == Cover::Tight),
            self.places(posed, |v| is_worn(v) && self.dressed.cover[v] == Cover::Bare),
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
        // A limb that was left out should show, too.
        let shown: Vec<(VertexId, f64)> =
            spread(&self.telling_areas(), SAMPLES).into_iter().filter(|&(v, _)| self.dressed.is_shown(v)).collect();
        let of_figure: Vec<(f64, bool)> = shown
            .par_iter()
            .map(|&(v, area)| {
                let hit = self.surface.nearest(&posed.points[v], SHOWN);
                (area, hit.is_some_and(|hit| hit.at_rim || hit.normal.dot(&normals[v]) > 0.0))
            })
            .collect();
        let mut beside = vec![0.0; self.body.skeleton.len()];
        for (area, v) in of_scan.iter().filter_map(|&(area, v)| Some((area, v?))) {
            beside[self.body.weights.rows()[v][0].0.index()] += area;
        }
        let most = beside.iter().enumerate().filter(|b| *b.1 > 0.0).max_by(|a, b| a.1.total_cmp(b.1));
        Agreement {
            explained: share(of_scan.iter().map(|s| (s.0, s.1.is_none()))),
            seen: share(of_figure.into_iter()),
            near: most.map(|(joint, _)| spoken(&self.body.skeleton.names[joint])),
        }
    }

    /// Where vertices are, of those that `count`.
    fn places(&self, posed: &Posed, count: impl Fn(VertexId) -> bool) -> NearestVertex {
        let places: Vec<Point> =
            posed.points.enumerate().filter(|(v, _)| count(*v) && !self.left_out[*v]).map(|(_, p)| *p).collect();
        NearestVertex::prepare(&places)
    }

    pub(super) fn refuse_what_is_not_this_figure(
        &self,
        residual: f64,
        lack: &Lack,
        agreement: &Agreement,
        unseen: &[JointId],
        posed: &Posed,
    ) -> Result<(), FitError> {
        let params = self.params;
        if residual > params.refuse_above {
            return Err(FitError::NotThisPerson { residual_mm: residual * 1e3, limit_mm: params.refuse_above * 1e3 });
        }
        if params.method == InsideMethod::Paper || !params.constrained {
            return Ok(());
        }
        // Limbs that are not seen do not count here: where the rest is far outside, it is not they that are wrong.
        if lack.depth_of_spot > params.refuse_outside {
            return Err(FitError::Outside {
                percent: lack.outside_share * 100.0,
                depth_mm: lack.depth_of_spot * 1e3,
                limit_mm: params.refuse_outside * 1e3,
                near: lack.near(&self.body.skeleton, self.body.weights).unwrap_or_else(|| "body".into()),
            });
        }
        if !params.missing_limbs {
            self.refuse_limbs_elsewhere(unseen, agreement, posed)?;
        }
        if agreement.explained < params.least_explained {
            return Err(FitError::Unexplained {
                percent: (1.0 - agreement.explained) * 100.0,
                limit_percent: (1.0 - params.least_explained) * 100.0,
                near: agreement.near.clone().unwrap_or_else(|| "body".into()),
            });
        }
        Ok(())
    }

    /// A limb that is missing leaves a hole where it would begin, and nothing that would be it.
    fn refuse_limbs_elsewhere(&self, unseen: &[JointId], agreement: &Agreement, posed: &Posed) -> Result<(), FitError> {
        /// Share of the surface, seen on scans with limbs cut off: 0 to 0.7 %; with arms crossed before the chest: 1.5 to 9.
        const LIMB: f64 = 0.01;
        /// From the joint the cut may lie this far, metres, and its rim is as long as a wrist is around.
        const CUT: f64 = 0.2;
        const LEAST_RIM: f64 = 0.15;
        for &limb in unseen {
            let rest = 1.0 - agreement.explained;
            let limb_name = spoken(&self.body.skeleton.names[limb.index()]);
            let what = if rest > LIMB {
                format!("and {:.1} % of the scan's surface is no part of the figure", rest * 100.0)
            } else if self.surface.rim_near(&posed.joints_in_world[limb.index()], CUT) < LEAST_RIM {
                "and the scan is whole where it would begin".into()
            } else {
                continue;
            };
            return Err(FitError::LimbNotFound { limb: limb_name, what });
        }
        Ok(())
    }
}

/// Of the areas the share for which something holds.
fn share(parts: impl Iterator<Item = (f64, bool)>) -> f64 {
    let (good, total) =
        parts.fold((0.0, 0.0), |(good, total), (area, holds)| (good + if holds { area } else { 0.0 }, total + area));
    if total > 0.0 { good / total } else { 1.0 }
}
