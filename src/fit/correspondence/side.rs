//! Sidedness: on which side of the scan a point of the body is.

use super::scan_surface::{ScanHit, ScanSurface};
use crate::geometry::{Point, Vec3};

/// The side of the scan on which a vertex is: `normal · (place − vertex) = clearance`, positive inside.
pub(crate) struct Sidedness {
    /// The corresponding point of the scan.
    pub(crate) place: Point,
    pub(crate) normal: Vec3,
    pub(crate) clearance: f64,
    /// Cosine between `normal` and the vertex's normal: the clearance gained per move along the latter.
    pub(crate) cosine: f64,
}

impl Sidedness {
    pub(crate) fn of(hit: &ScanHit, p: &Point, n: &Vec3) -> Self {
        Self {
            place: hit.point,
            normal: hit.normal,
            clearance: hit.normal.dot(&(hit.point - p)),
            cosine: hit.normal.dot(n),
        }
    }
}

/// The side of a vertex with normal `n`, by the closest point of the scan if it faces the same way, else by the first such
/// point along the normal, outward or inward. `None` at holes.
pub(crate) fn side_of(surface: &ScanSurface, p: &Point, n: &Vec3) -> Option<Sidedness> {
    /// Greatest stand-off of cloth, in metres: that of a coat's hem is less.
    const REACH: f64 = 0.12;
    /// Greatest depth of a body vertex outside the scan after a good fit, in metres.
    const DEEPEST: f64 = 0.03;
    /// Normals that differ by more than 73° belong to another side of the limb or to another limb.
    const LEAST_COSINE: f64 = 0.3;
    if let Some(hit) = surface.nearest(p, REACH) {
        if hit.at_rim {
            return None;
        }
        if hit.normal.dot(n) > LEAST_COSINE {
            return Some(Sidedness::of(&hit, p, n));
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
    Some(Sidedness::of(&hit, p, n))
}
