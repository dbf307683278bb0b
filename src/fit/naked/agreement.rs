//! How far a fit can be trusted: what of the scan the body explains, and what of the body the scan shows.

use crate::body::{Skeleton, SkinWeights};
use crate::fit::correspondence::{ScanSurface, display_name, dominant_joint, mean_and_p95, spread};
use crate::geometry::{SurfaceIndex, VertexId};
use rayon::prelude::*;

/// Within this distance, and facing the same way, body and scan are one surface. Metres: five times what a 15-component
/// model leaves on strangers.
const ONE_SURFACE: f64 = 0.025;

/// Cosine between normals of one surface: 73°, for hands that a scanner melted into mittens.
const LEAST_COSINE: f64 = 0.3;

/// SamplePlaces of either surface: 1 % of its area is then fifty of them.
const SAMPLES: usize = 5000;

/// A share of the scan that is worth a word.
const WORTH_SAYING: f64 = 0.02;

/// What half a person lacks; an arm, a leg or the head may be missing.
const REGIONS: [(&str, &[&str]); 3] = [
    ("chest", &["chest", "upperChest"]),
    ("hips", &["hips", "spine"]),
    ("legs", &["leftUpperLeg", "leftLowerLeg", "rightUpperLeg", "rightLowerLeg"]),
];

/// A region of which the scan shows less is not in it: half a turn shows half, a quarter of a turn a third.
const LEAST_OF_REGION: f64 = 0.25;

/// How much two surfaces have in common.
pub(crate) struct Agreement {
    /// Area share of the scan that lies on the body.
    pub(crate) explained: f64,
    /// Area share of the body that lies on the scan.
    pub(crate) seen: f64,
    /// Mean distance of the scan from the body, and its 95th percentile, in metres.
    pub(crate) residual: (f64, f64),
    /// (Nearest vertex, area, whether it lies on the scan) of places of the body.
    of_body: Vec<(VertexId, f64, bool)>,
    /// Of the scan's area that is not explained: by the body's nearest vertex.
    unexplained: Vec<(VertexId, f64)>,
}

/// Compares a posed body with a scan.
pub(crate) fn agreement(index: &SurfaceIndex, surface: &ScanSurface) -> Agreement {
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
    Agreement {
        explained: 1.0 - unexplained.iter().map(|u| u.1).sum::<f64>(),
        seen: of_body.iter().filter(|s| s.2).map(|s| s.1).sum::<f64>() / f64::max(body_area, 1e-12),
        residual: mean_and_p95(of_scan.iter().map(|s| s.1).collect()),
        of_body,
        unexplained,
    }
}

impl Agreement {
    /// 0 to 1.
    pub(crate) fn confidence(&self) -> f64 {
        self.explained * self.seen
    }

    /// The first of the regions that make a person of which the scan shows next to nothing.
    pub(crate) fn missing_region(&self, weights: &SkinWeights, skeleton: &Skeleton) -> Option<&'static str> {
        REGIONS
            .iter()
            .find(|(_, names)| {
                let is_of = |v: VertexId| names.contains(&skeleton.names[weights.rows()[v][0].0.index()].as_str());
                let (mut total, mut seen) = (0.0, 0.0);
                for &(_, area, is_seen) in self.of_body.iter().filter(|b| is_of(b.0)) {
                    total += area;
                    seen += if is_seen { area } else { 0.0 };
                }
                total > 0.0 && seen < LEAST_OF_REGION * total
            })
            .map(|(name, _)| *name)
    }

    /// The part of the body beside which most of the scan is unexplained.
    pub(crate) fn least_explained_part(&self, weights: &SkinWeights, skeleton: &Skeleton) -> Option<String> {
        let joint = dominant_joint(self.unexplained.iter().copied(), weights, skeleton.len())?;
        Some(display_name(&skeleton.names[joint.index()]))
    }
}

/// A sentence where the scan shows more than a body.
pub(crate) fn unexplained_summary(agreement: &Agreement, weights: &SkinWeights, skeleton: &Skeleton) -> Option<String> {
    let part = agreement.least_explained_part(weights, skeleton)?;
    let share = 1.0 - agreement.explained;
    (share > WORTH_SAYING).then(|| {
        format!("{:.0} % of the scan's surface is no part of the fitted body, most of it at the {part}", share * 100.0)
    })
}
