//! Closes places within a garment that labels left out although its kind has no hem there.

use super::holes::fill_holes::FilledScan;
use super::slice::Slice;
use crate::geometry::{Adjacency, PerVertex, VertexId};

/// Area of such a place, in m²: smaller ones are closed anyway. A patch in the colours of the layer below had 45 cm² (seed 2102), and the
/// hand beyond a cuff has 200 on a child.
const AREA: std::ops::Range<f64> = 2e-4..80e-4;

/// The hems that a cut has, holes of the scan not counted.
pub(super) fn hem_count(slice: &Slice) -> usize {
    let is_hem = |ring: &&Vec<VertexId>| {
        let cut = ring.iter().filter(|v| slice.on_cut[v.index()]).count();
        // A tenth: as a loop is told from a hole of the scan.
        10 * cut >= ring.len()
    };
    slice.adjacency().boundary_loops().iter().filter(is_hem).count()
}

/// `field`, positive on the garment, made so on the smallest `count` places that the garment surrounds; `None` if there is none.
/// Where the user painted, or the scan has a hole, nothing is closed.
///
/// **Shapes** one value per vertex of `whole`, whose adjacency is `around`.
pub(super) fn closed(
    whole: &FilledScan,
    around: &Adjacency,
    field: &PerVertex<f64>,
    count: usize,
) -> Option<(PerVertex<f64>, Vec<f64>)> {
    if count == 0 {
        return None;
    }
    let mesh = &whole.surface.mesh;
    let (areas, at_end) = (mesh.vertex_areas(), around.boundary_vertices());
    let is_certain = |v: &VertexId| at_end[*v] || whole.by_hand[*v] || whole.beside_hole[*v];
    let is_out = field.iter().map(|&f| f <= 0.0).collect();
    let mut places: Vec<(f64, Vec<VertexId>)> = around
        .parts_of(&is_out)
        .into_iter()
        .map(|part| (part.iter().map(|&v| areas[v]).sum::<f64>(), part))
        .filter(|(area, part)| AREA.contains(area) && !part.iter().any(is_certain))
        .collect();
    places.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1[0].cmp(&b.1[0])));
    places.truncate(count);
    if places.is_empty() {
        return None;
    }
    let mut closed = field.clone();
    for &v in places.iter().flat_map(|place| &place.1) {
        closed[v] = 1.0;
    }
    Some((closed, places.into_iter().map(|place| place.0).collect()))
}
