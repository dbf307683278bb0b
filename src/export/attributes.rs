//! What files say about each vertex besides its skin: attributes of the same names in every format.

use super::format::CharacterOptions;
use crate::body::{Figure, Layer};
use crate::geometry::{PerVertex, SurfaceIndex, TriMesh};
use rayon::prelude::*;

/// How far cloth whose share of physics is greatest may leave its skinned place, in metres: a skirt's hem in a walk.
pub(super) const LOOSE_REACH: f64 = 0.3;
/// The same for cloth that does not hang loose.
const FITTED_REACH: f64 = 0.03;
/// The greatest share of physics (Hu 2017, Eq. 9).
pub(in crate::export) const GREATEST_SHARE: f64 = 0.5;

/// A layer's attributes by their names, without their underscore.
///
/// **Shapes** each has one entry per vertex.
pub(super) fn attributes_of(
    layer: &Layer,
    rank: usize,
    options: &CharacterOptions,
    ease: Option<&PerVertex<f32>>,
) -> Vec<(&'static str, PerVertex<f32>)> {
    let count = layer.mesh.vertex_count();
    let flags = |flags: &PerVertex<bool>| flags.iter().map(|&flag| f32::from(u8::from(flag))).collect();
    let shares = layer.physics.as_ref().map(|physics| physics.iter().map(|&share| share as f32).collect());
    let mut attributes = vec![
        ("PHYSW", shares.unwrap_or_else(|| PerVertex::filled(0.0, count))),
        ("LAYER", PerVertex::filled(rank as f32, count)),
    ];
    if let Some(masks) = &options.covered {
        attributes.push(("COVERED", flags(&masks[rank])));
    }
    if rank > 0 {
        attributes.push(("SEEN", layer.is_seen.as_ref().map_or_else(|| PerVertex::filled(1.0, count), flags)));
        attributes.push(("MAXDIST", reach(layer, options.loose.get(rank))));
    }
    attributes.extend(ease.map(|ease| ("EASE", ease.clone())));
    attributes
}

/// How far each vertex may leave its skinned place when cloth is simulated, in metres.
pub(super) fn reach(layer: &Layer, loose: Option<&PerVertex<bool>>) -> PerVertex<f32> {
    let Some(physics) = &layer.physics else { return PerVertex::filled(0.0, layer.mesh.vertex_count()) };
    let most = |v: usize| if loose.is_some_and(|loose| loose.0[v]) { LOOSE_REACH } else { FITTED_REACH };
    physics.iter().enumerate().map(|(v, share)| (share / GREATEST_SHARE * most(v)) as f32).collect()
}

/// The air between each garment and what is worn below it, in metres, in the bind pose.
///
/// **Shapes** one entry per layer, `None` for the body, with one per vertex.
pub(super) fn ease_of(figure: &Figure) -> Vec<Option<PerVertex<f32>>> {
    let surfaces: Vec<SurfaceIndex> =
        figure.layers.par_iter().map(|layer| SurfaceIndex::prepare(&layer.mesh)).collect();
    let ease = |mesh: &TriMesh, rank: usize| -> PerVertex<f32> {
        let air = |p| surfaces[..rank].iter().map(|below| below.closest(p).distance).fold(f64::INFINITY, f64::min);
        PerVertex(mesh.points().0.par_iter().map(|p| air(p) as f32).collect())
    };
    figure.layers.iter().enumerate().map(|(rank, layer)| (rank > 0).then(|| ease(&layer.mesh, rank))).collect()
}
