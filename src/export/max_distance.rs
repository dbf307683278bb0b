//! How far cloth may leave the place that skinning gives it.

use crate::body::Layer;
use crate::geometry::PerVertex;

/// How far cloth whose share of physics is greatest may leave its skinned place, in metres: a skirt's hem in a walk.
pub(super) const LOOSE_MAX_DISTANCE: f64 = 0.3;
/// The same for cloth that does not hang loose.
const FITTED_MAX_DISTANCE: f64 = 0.03;
/// The greatest share of physics (Hu 2017, Eq. 9).
pub(in crate::export) const GREATEST_SHARE: f64 = 0.5;

/// How far each vertex may leave its skinned place when cloth is simulated, in metres.
pub(super) fn max_distance(layer: &Layer, loose: Option<&PerVertex<bool>>) -> PerVertex<f32> {
    let Some(physics) = &layer.physics else { return PerVertex::filled(0.0, layer.mesh.vertex_count()) };
    let most = |v: usize| if loose.is_some_and(|loose| loose.0[v]) { LOOSE_MAX_DISTANCE } else { FITTED_MAX_DISTANCE };
    physics.iter().enumerate().map(|(v, share)| (share / GREATEST_SHARE * most(v)) as f32).collect()
}
