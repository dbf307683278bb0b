//! The area within a closed line of points.

use crate::geometry::{Point, Vec3};

/// The area within a ring, in m².
pub(in crate::cut) fn area_within(ring: &[Point]) -> f64 {
    0.5 * twice_area_vector(ring).norm()
}

/// Twice the vector area within a ring, in m².
pub(in crate::cut) fn twice_area_vector(ring: &[Point]) -> Vec3 {
    let next = |i: usize| ring[(i + 1) % ring.len()];
    (0..ring.len()).map(|i| (ring[i] - ring[0]).cross(&(next(i) - ring[0]))).sum()
}
