//! On which side of the scan a place of the body lies.

use super::scan_surface::{ScanHit, ScanSurface};
use crate::geometry::{Point, Vec3};

/// The side of the scan on which a vertex lies: `normal · (place − vertex) = clearance`, positive inside.
pub(crate) struct Side {
    /// The place of the scan.
    pub(crate) place: Point,
    pub(crate) normal: Vec3,
    pub(crate) clearance: f64,
    /// Cosine between `normal` and the vertex's own: a move along the latter gains this share of clearance.
    pub(crate) cosine: f64,
}

impl Side {
    pub(crate) fn of(hit: &ScanHit, p: &Point, n: &Vec3) -> Self {
        Self {
            place: hit.point,
            normal: hit.normal,
            clearance: hit.normal.dot(&(hit.point - p)),
            cosine: hit.normal.dot(n),
        }
    }
}

/// Where a vertex with normal `n` lies against the scan: by the nearest place that faces the same way, else by the first
/// one that does along the normal, outward or inward. `None` at holes.
pub(crate) fn side_of(surface: &ScanSurface, p: &Point, n: &Vec3) -> Option<Side> {
    /// Beyond this no cloth is expected: a coat's hem stands off by less. Metres.
    const REACH: f64 = 0.12;
    /// A body vertex is never deeper outside than this after a sane fit. Metres.
    const DEEPEST: f64 = 0.03;
    /// Normals that differ by more (73°) belong to another side of the limb or to another limb.
    const LEAST_COSINE: f64 = 0.3;
    if let Some(hit) = surface.nearest(p, REACH) {
        if hit.at_rim {
            return None;
        }
        if hit.normal.dot(n) > LEAST_COSINE {
            return Some(Side::of(&hit, p, n));
        }
    }
    let facing = |direction: Vec3, max: f64| {
        surface.along(p, &direction, max).filter(|h| !h.at_rim && h.normal.dot(n) > LEAST_COSINE)
    };
    let outward = facing(*n, REACH);
    let inward = facing(-n, DEEPEST);
    let hit = match (outward, inward) {
        (Some(a), Some(b)) if b.distance < a.distance => b,
        (Some(a), _) => a,
        (None, Some(b)) => b,
        (None, None) => return None,
    };
    Some(Side::of(&hit, p, n))
}
