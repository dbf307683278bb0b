//! What files say about each vertex besides its skin: attributes of the same names in every format.

use super::format::CharacterOptions;
use super::max_distance::max_distance;
use crate::body::{Figure, Layer};
use crate::geometry::{PerVertex, SurfaceIndex, TriMesh};
use rayon::prelude::*;

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
        let per_metre = (1.0 / options.axes.unit.metres()) as f32;
        let most = max_distance(layer, options.loose.get(rank));
        attributes.push(("MAXDIST", most.iter().map(|most| most * per_metre).collect()));
    }
    attributes.extend(ease.map(|ease| ("EASE", ease.clone())));
    attributes
}

/// The air between each garment and what is worn below it, in the figure's unit, in the bind pose.
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
