//! Vertices inside an inner layer, whichever limb they belong to.

use crate::geometry::{Adjacency, PerVertex, Point, SurfaceIndex, SurfacePoint, TriMesh, Vec3, VertexId};
use rayon::prelude::*;

/// The border of a surface, beyond which nothing is inside it.
pub(super) struct Border {
    on_boundary: PerVertex<bool>,
    /// Whether there is none.
    pub is_closed: bool,
}

impl Border {
    pub(super) fn of(mesh: &TriMesh) -> Self {
        let adjacency = Adjacency::prepare(mesh);
        Self { is_closed: adjacency.boundary_edges().is_empty(), on_boundary: adjacency.boundary_vertices() }
    }

    /// Whether a point of the surface is on the border.
    pub(super) fn has(&self, mesh: &TriMesh, at: &SurfacePoint) -> bool {
        let corners = mesh.faces()[at.face];
        !self.is_closed
            && at.barycentric.contains(&0.0)
            && (0..3).all(|k| at.barycentric[k] == 0.0 || self.on_boundary[corners[k]])
    }
}

/// The closest point of a surface if `p` is inside it, whichever limb it belongs to. Inside is behind the surface; behind an
/// open surface no deeper than `greatest_depth`, in metres, and not beyond its border.
pub(super) fn point_above(
    surface: &SurfaceIndex,
    border: &Border,
    p: &Point,
    greatest_depth: f64,
) -> Option<SurfacePoint> {
    let reach = if border.is_closed { f64::INFINITY } else { greatest_depth };
    let at = surface.closest_within(p, reach)?;
    let is_behind = (p - at.point).dot(&surface.pseudonormal(&at)) < 0.0;
    (!border.has(surface.mesh(), &at) && is_behind).then_some(at)
}

/// A vertex inside an inner layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Insider {
    /// The layer of the vertex.
    pub layer: usize,
    /// The vertex, counted within its layer.
    pub vertex: VertexId,
    /// The way to the closest point of the layer inside which it is, in metres.
    pub way_out: Vec3,
}

/// All vertices of `layers` that are inside a layer further in, by layer and vertex.
///
/// **Shapes** `layers`: innermost first.
pub(super) fn insiders(layers: &[TriMesh], greatest_depth: f64) -> Vec<Insider> {
    let mut found = Vec::new();
    let mut inner: Vec<(SurfaceIndex, Border)> = Vec::new();
    for (k, layer) in layers.iter().enumerate() {
        let adjacency = Adjacency::prepare(layer);
        let inside_any = |(v, p): (usize, &Point)| {
            // A vertex without faces is not seen.
            if adjacency.faces_of(VertexId::from_index(v)).is_empty() {
                return None;
            }
            let at = inner.iter().find_map(|(surface, border)| point_above(surface, border, p, greatest_depth))?;
            Some(Insider { layer: k, vertex: VertexId::from_index(v), way_out: at.point - p })
        };
        found.extend(layer.points().0.par_iter().enumerate().filter_map(inside_any).collect::<Vec<_>>());
        if k + 1 < layers.len() {
            inner.push((SurfaceIndex::prepare(layer), Border::of(layer)));
        }
    }
    found
}
