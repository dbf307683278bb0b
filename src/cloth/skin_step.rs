//! What moves cloth in a step: the skin, and gravity.

use crate::geometry::{Point, Vec3};

/// Gravity, m/s².
pub(super) const GRAVITY: f64 = 9.81;

/// A step of the skin.
///
/// **Shapes** one entry per vertex of the figure.
#[derive(Clone, Copy)]
pub(super) struct SkinStep<'a> {
    /// The skinned places at its start and at its end.
    pub before: &'a [Point],
    pub places: &'a [Point],
    /// Gravity as the skin carries it along.
    pub carried: &'a [Vec3],
    /// Its duration, seconds.
    pub secs: f64,
}
