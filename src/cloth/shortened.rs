//! Vectors of a limited length.

use crate::geometry::Vec3;

/// `v`, or shorter in the same direction.
pub(super) fn shortened(v: Vec3, most: f64) -> Vec3 {
    let length = v.norm();
    if length > most { v * (most / length) } else { v }
}
