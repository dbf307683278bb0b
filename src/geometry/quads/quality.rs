//! Shapes of quads.

use crate::geometry::{Point, Vec3};

/// The angles of a quad, in degrees; those of corners that turn the wrong way, seen against `normal`, are negative.
pub(super) fn angles_deg(quad: &[Point; 4], normal: &Vec3) -> [f64; 4] {
    std::array::from_fn(|k| {
        let to = quad[(k + 1) % 4] - quad[k];
        let from = quad[(k + 3) % 4] - quad[k];
        let cross = to.cross(&from);
        let angle = cross.norm().atan2(to.dot(&from)).to_degrees();
        if cross.dot(normal) < 0.0 { -angle } else { angle }
    })
}

/// The smallest angle, or 180° minus the greatest if that is less; negative if the quad is not convex.
pub(super) fn quad_quality_deg(quad: &[Point; 4], normal: &Vec3) -> f64 {
    angles_deg(quad, normal)
        .into_iter()
        .map(|angle| if angle < 0.0 { angle } else { angle.min(180.0 - angle) })
        .fold(180.0, f64::min)
}
