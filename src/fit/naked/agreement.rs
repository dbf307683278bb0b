//! Agreement of a fitted body with a naked scan: which share of the scan it explains, and which share of it the scan shows.

use crate::body::HumanJoint::{Chest, Hips, LowerLeg, Spine, UpperChest, UpperLeg};
use crate::body::{HumanJoint, Side, Skeleton, SkinWeights, dominant_body_joint};
use crate::fit::correspondence::{ScanSurface, dominant_joint, mean_and_p95, spread};
use crate::geometry::{SurfaceIndex, VertexId};
use rayon::prelude::*;

/// Body and scan agree within this distance if they face the same way. Metres: five times the residual of a 15-component
/// model on people outside its training set.
const ONE_SURFACE: f64 = 0.025;

/// Least cosine between normals that agree: 73°, for hands that a scanner merged into mittens.
const LEAST_COSINE: f64 = 0.3;

/// Sample points per surface: 1 % of the area is fifty of them.
const SAMPLES: usize = 5000;

/// Smaller unexplained shares of the scan are not reported.
const LEAST_REPORTED: f64 = 0.02;

/// Regions that a scan must show; an arm, a leg or the head may be missing.
const REGIONS: [(&str, &[HumanJoint]); 3] = [
    ("chest", &[Chest, UpperChest]),
    ("hips", &[Hips, Spine]),
    ("legs", &[UpperLeg(Side::Left), LowerLeg(Side::Left), UpperLeg(Side::Right), LowerLeg(Side::Right)]),
];

/// A scan that shows less than this share of a region does not show it: half a turn shows half, a quarter of a turn a third.
const LEAST_OF_REGION: f64 = 0.25;

/// Agreement of two surfaces.
pub(crate) struct NakedAgreement {
    /// Area share of the scan that lies on the body.
    pub(crate) explained: f64,
    /// Area share of the body that lies on the scan.
    pub(crate) seen: f64,
    /// Mean distance of the scan from the body, and its 95th percentile, in metres.
    pub(crate) residual: (f64, f64),
    /// (Nearest vertex, area, whether it lies on the scan) of sample points of the body.
    of_body: Vec<(VertexId, f64, bool)>,
    /// (Nearest vertex of the body, area share) of the unexplained sample points of the scan.
    unexplained: Vec<(VertexId, f64)>,
}

/// Compares a posed body with a scan.
pub(crate) fn agreement(index: &SurfaceIndex, surface: &ScanSurface) -> NakedAgreement {
    let body = index.mesh();
    let normals = body.vertex_normals_by_area();
    let of_scan: Vec<(f64, f64, Option<VertexId>)> = surface
        .samples(SAMPLES)
        .par_iter()
        .map(|&(v, area)| {
            let p = &surface.mesh().points()[v];
            let at = index.closest_within(p, ONE_SURFACE).unwrap_or_else(|| index.closest(p));
            let same = at.distance < ONE_SURFACE && body.face_normal(at.face).dot(&surface.normals[v]) > LEAST_COSINE;
            (area, at.distance, (!same).then(|| at.nearest_corner(body)))
        })
        .collect();
    let of_body: Vec<(VertexId, f64, bool)> = spread(&body.vertex_areas(), SAMPLES)
        .par_iter()
        .map(|&(v, area)| {
            let hit = surface.nearest(&body.points()[v], ONE_SURFACE);
            (v, area, hit.is_some_and(|hit| hit.normal.dot(&normals[v]) > LEAST_COSINE))
        })
        .collect();
    let scan_area: f64 = of_scan.iter().map(|s| s.0).sum();
    let body_area: f64 = of_body.iter().map(|s| s.1).sum();
    let unexplained: Vec<(VertexId, f64)> = of_scan.iter().filter_map(|&(a, _, v)| Some((v?, a / scan_area))).collect();
    NakedAgreement {
        explained: 1.0 - unexplained.iter().map(|u| u.1).sum::<f64>(),
        seen: of_body.iter().filter(|s| s.2).map(|s| s.1).sum::<f64>() / f64::max(body_area, 1e-12),
        residual: mean_and_p95(of_scan.iter().map(|s| s.1).collect()),
        of_body,
        unexplained,
    }
}

impl NakedAgreement {
    /// Confidence of the fit, 0 to 1.
    pub(crate) fn confidence(&self) -> f64 {
        self.explained * self.seen
    }

    /// The first required region of which the scan shows almost nothing.
    pub(crate) fn missing_region(&self, weights: &SkinWeights, skeleton: &Skeleton) -> Option<&'static str> {
        let body_joints = skeleton.body_joints();
        REGIONS
            .iter()
            .find(|(_, joints)| {
                let moves = |v: VertexId| skeleton.human_joint(dominant_body_joint(&weights.rows()[v], &body_joints));
                let is_of = |v: VertexId| moves(v).is_some_and(|joint| joints.contains(&joint));
                let (mut total, mut seen) = (0.0, 0.0);
                for &(_, area, is_seen) in self.of_body.iter().filter(|b| is_of(b.0)) {
                    total += area;
                    seen += if is_seen { area } else { 0.0 };
                }
                total > 0.0 && seen < LEAST_OF_REGION * total
            })
            .map(|(name, _)| *name)
    }

    /// The part of the body that is nearest to most of the unexplained scan.
    pub(crate) fn least_explained_part(&self, weights: &SkinWeights, skeleton: &Skeleton) -> Option<String> {
        let joint = dominant_joint(self.unexplained.iter().copied(), weights, skeleton)?;
        Some(skeleton.part_name(joint))
    }
}

/// One sentence if part of the scan is unexplained.
pub(crate) fn unexplained_summary(
    agreement: &NakedAgreement,
    weights: &SkinWeights,
    skeleton: &Skeleton,
) -> Option<String> {
    let part = agreement.least_explained_part(weights, skeleton)?;
    let share = 1.0 - agreement.explained;
    (share > LEAST_REPORTED).then(|| {
        format!("{:.0} % of the scan's surface does not match the fitted body, most of it at the {part}", share * 100.0)
    })
}
