//! Vertices inside an inner layer, whichever limb they belong to.

use crate::geometry::{Adjacency, PerVertex, Point, SurfaceIndex, SurfacePoint, TriMesh, Vec3, VertexId};
use rayon::prelude::*;

/// A surface that can tell what is inside it.
pub(super) struct Inside {
    index: SurfaceIndex,
    on_boundary: PerVertex<bool>,
    is_closed: bool,
    greatest_depth: f64,
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

impl Inside {
    /// `greatest_depth`: deeper behind an open surface a point is not inside, in metres.
    pub(super) fn of(mesh: &TriMesh, greatest_depth: f64) -> Self {
        let adjacency = Adjacency::prepare(mesh);
        Self {
            index: SurfaceIndex::prepare(mesh),
            is_closed: adjacency.boundary_edges().is_empty(),
            on_boundary: adjacency.boundary_vertices(),
            greatest_depth,
        }
    }

    /// The closest point of the surface if `p` is inside. Inside is behind the surface; behind an open surface no deeper
    /// than cloth can be, and not beyond its border.
    fn point_above(&self, p: &Point) -> Option<SurfacePoint> {
        let reach = if self.is_closed { f64::INFINITY } else { self.greatest_depth };
        let at = self.index.closest_within(p, reach)?;
        let is_behind = (p - at.point).dot(&self.index.pseudonormal(&at)) < 0.0;
        (is_behind && !self.is_on_boundary(&at)).then_some(at)
    }

    fn is_on_boundary(&self, at: &SurfacePoint) -> bool {
        let corners = self.index.mesh().faces()[at.face];
        !self.is_closed
            && at.barycentric.contains(&0.0)
            && (0..3).all(|k| at.barycentric[k] == 0.0 || self.on_boundary[corners[k]])
    }
}

/// All vertices of `layers` that are inside a layer further in, by layer and vertex.
///
/// **Shapes** `layers`: innermost first.
pub(super) fn insiders(layers: &[TriMesh], greatest_depth: f64) -> Vec<Insider> {
    let mut found = Vec::new();
    let mut inner: Vec<Inside> = Vec::new();
    for (k, layer) in layers.iter().enumerate() {
        let adjacency = Adjacency::prepare(layer);
        let inside_any = |(v, p): (usize, &Point)| {
            // A vertex without faces is not seen.
            if adjacency.faces_of(VertexId::from_index(v)).is_empty() {
                return None;
            }
            let at = inner.iter().find_map(|surface| surface.point_above(p))?;
            Some(Insider { layer: k, vertex: VertexId::from_index(v), way_out: at.point - p })
        };
        found.extend(layer.points().0.par_iter().enumerate().filter_map(inside_any).collect::<Vec<_>>());
        if k + 1 < layers.len() {
            inner.push(Inside::of(layer, greatest_depth));
        }
    }
    found
}
