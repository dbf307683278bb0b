//! Refined parts: boundaries between limbs and torso where the person's joints are.
//!
//! **Source** Shi 2020, §4.2, Eqs. 1–4, with what they leave open:
//! - Eqs. 1 and 2 put all cloth beyond a vertical plane into the sleeve. That is also the side of a wide hem, so cloth below the
//!   keypoint changes its part only where it is nearer to the cuff than the keypoint is, and all must hang together.
//! - Eq. 3 takes the highest vertex of both legs as the crotch. A leg's coarse part is higher at the hip than at the crotch where
//!   the waistband slopes; we take the highest vertex near the middle plane.
//! - Eq. 4's slope is 1 for most trousers. Where that plane would cut the waistband, the slope is smaller.
//! - Dresses aren't defined: sleeves and one torso. Skirts: one torso.

use super::reeb::GarmentPart;
use crate::body::Side;
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, Vec3, VertexId, geodesic_distances};
use crate::tryon::recognize::Openings;

/// k_l of Eq. 4, which the paper gives as 1 for most trousers.
const SLOPE: f64 = 1.0;
/// The crotch is the highest vertex of a leg within this distance from the middle plane, relative to the torso's half width.
const MIDDLE_PER_WIDTH: f64 = 0.35;
/// A plane stays below this share of the way from the crotch to the waistband.
const HIGHEST_SHARE: f64 = 0.8;

/// A boundary surface: the limb's part is on the side that the normal points to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundaryPlane {
    /// Which limb it bounds.
    pub side: Side,
    /// The keypoint, on the plane, in metres.
    pub keypoint: Point,
    /// Unit normal, towards the limb.
    pub normal: Vec3,
}

/// Parts after refinement.
#[derive(Clone, Debug, PartialEq)]
pub struct RefinedParts {
    /// **Shapes** one per vertex.
    pub part_of: PerVertex<GarmentPart>,
    /// The planes of Eqs. 2 and 4, the left first; none where there is no limb, or without refinement.
    pub planes: Vec<BoundaryPlane>,
}

/// Moves the boundaries of coarse parts to planes at the joints; with `refine` off they stay (Fig. 2's ablation).
///
/// **Requires** a garment that is upright and in metres.
///
/// **Guarantees** the parts are disjoint and cover the garment; each limb's part is connected.
pub fn refined_parts(
    garment: &TriMesh,
    adjacency: &Adjacency,
    openings: &Openings,
    coarse: &PerVertex<GarmentPart>,
    refine: bool,
) -> RefinedParts {
    let planes = match (refine, openings) {
        (false, _) | (_, Openings::Tube { .. }) => Vec::new(),
        (_, Openings::Top { .. } | Openings::Open { .. }) => sleeve_planes(garment, coarse),
        (_, Openings::Legs { waist, .. }) => {
            let lowest = waist.ring.iter().map(|&v| garment.points()[v].y).fold(f64::INFINITY, f64::min);
            leg_planes(garment, coarse, lowest)
        }
    };
    let mut part_of = coarse.clone();
    for plane in &planes {
        let is_sleeve = plane.normal.y == 0.0;
        let nearer = if is_sleeve { under_sleeve(garment, adjacency, openings, plane) } else { None };
        for v in garment.vertex_ids().filter(|&v| coarse[v] == GarmentPart::Torso) {
            let from = garment.points()[v] - plane.keypoint;
            let is_of_limb = match is_sleeve {
                true => from.y >= 0.0 || nearer.as_ref().is_some_and(|nearer| nearer[v]),
                false => from.x * plane.side.sign() > 0.0,
            };
            if is_of_limb && from.dot(&plane.normal) > 0.0 {
                part_of[v] = GarmentPart::Limb(plane.side);
            }
        }
    }
    keep_connected(adjacency, openings, &mut part_of);
    RefinedParts { part_of, planes }
}

/// Which vertices are nearer to the cuff than the keypoint is.
fn under_sleeve(
    garment: &TriMesh,
    adjacency: &Adjacency,
    openings: &Openings,
    plane: &BoundaryPlane,
) -> Option<PerVertex<bool>> {
    let rim = &openings.pair()?[usize::from(plane.side == Side::Right)];
    let sources: Vec<(VertexId, f64)> = rim.ring.iter().map(|&v| (v, 0.0)).collect();
    let distance = geodesic_distances(garment, adjacency, &sources, f64::INFINITY);
    let of_keypoint = garment.vertex_ids().find(|&v| garment.points()[v] == plane.keypoint).map(|v| distance[v])?;
    Some(distance.iter().map(|d| *d < of_keypoint).collect())
}

/// Eqs. 1 and 2.
fn sleeve_planes(garment: &TriMesh, coarse: &PerVertex<GarmentPart>) -> Vec<BoundaryPlane> {
    let of_side = |side: Side| {
        let innermost = garment
            .vertex_ids()
            .filter(|&v| coarse[v] == GarmentPart::Limb(side))
            .min_by(|&a, &b| (garment.points()[a].x * side.sign()).total_cmp(&(garment.points()[b].x * side.sign())))?;
        Some(BoundaryPlane { side, keypoint: garment.points()[innermost], normal: Vec3::x() * side.sign() })
    };
    Side::BOTH.into_iter().filter_map(of_side).collect()
}

/// Eqs. 3 and 4. `waist` is the height of the waistband's lowest point.
fn leg_planes(garment: &TriMesh, coarse: &PerVertex<GarmentPart>, waist: f64) -> Vec<BoundaryPlane> {
    let torso: Vec<f64> = garment
        .points()
        .iter()
        .zip(coarse.iter())
        .filter(|(_, c)| **c == GarmentPart::Torso)
        .map(|(p, _)| p.x)
        .collect();
    let middle = torso.iter().sum::<f64>() / torso.len().max(1) as f64;
    let half_width = torso.iter().map(|x| (x - middle).abs()).fold(0.0, f64::max);
    let legs = || garment.points().iter().zip(coarse.iter()).filter(|(_, part)| **part != GarmentPart::Torso);
    let highest = |within: f64| {
        legs().filter(|(p, _)| (p.x - middle).abs() <= within).map(|(p, _)| p.y).fold(f64::NEG_INFINITY, f64::max)
    };
    let crotch = Some(highest(MIDDLE_PER_WIDTH * half_width)).filter(|y| y.is_finite());
    let crotch = crotch.unwrap_or_else(|| highest(f64::INFINITY));
    if !crotch.is_finite() || torso.is_empty() {
        return Vec::new();
    }
    let steepest = HIGHEST_SHARE * (waist - crotch).max(0.0) / half_width.max(f64::MIN_POSITIVE);
    let slope = SLOPE.min(steepest);
    let depth = legs().map(|(p, _)| p.z).sum::<f64>() / legs().count().max(1) as f64;
    let keypoint = Point::new(middle, crotch, depth);
    Side::BOTH
        .into_iter()
        .map(|side| BoundaryPlane { side, keypoint, normal: Vec3::new(slope * side.sign(), -1.0, 0.0).normalize() })
        .collect()
}

/// Each limb keeps the component with most of its rim; components of the torso beside its largest go to the limb around them.
fn keep_connected(adjacency: &Adjacency, openings: &Openings, part_of: &mut PerVertex<GarmentPart>) {
    let Some(pair) = openings.pair() else { return };
    for (side, rim) in Side::BOTH.into_iter().zip(pair) {
        let limb = GarmentPart::Limb(side);
        let components = adjacency.parts_of(&part_of.iter().map(|part| *part == limb).collect());
        let mut is_rim = PerVertex::filled(false, part_of.len());
        rim.ring.iter().for_each(|&v| is_rim[v] = true);
        let of_rim = |part: &[VertexId]| (part.iter().filter(|v| is_rim[**v]).count(), part.len());
        let kept = (0..components.len()).max_by_key(|&k| (of_rim(&components[k]), std::cmp::Reverse(k)));
        for (k, component) in components.iter().enumerate() {
            if Some(k) != kept {
                component.iter().for_each(|&v| part_of[v] = GarmentPart::Torso);
            }
        }
    }
    let components = adjacency.parts_of(&part_of.iter().map(|part| *part == GarmentPart::Torso).collect());
    let largest = (0..components.len()).max_by_key(|&k| (components[k].len(), std::cmp::Reverse(k)));
    for component in components.iter().enumerate().filter(|(k, _)| Some(*k) != largest).map(|(_, c)| c) {
        let around = component.iter().flat_map(|&v| adjacency.neighbours_of(v)).map(|&n| part_of[n]);
        if let Some(limb) = around.filter(|part| *part != GarmentPart::Torso).min() {
            component.iter().for_each(|&v| part_of[v] = limb);
        }
    }
}
