//! The part of a mesh where a field is positive, cut through its triangles.

use crate::geometry::{Adjacency, MeshError, PerVertex, Point, TriMesh, VertexId};
use std::cell::OnceCell;
use std::collections::HashMap;

/// Share of an edge within which a crossing snaps to the corner, to avoid slivers.
const SNAP_PER_EDGE: f64 = 0.1;

/// A part of a scan.
///
/// **Shapes** `origins`, `on_cut` and `is_seen`: one entry per vertex of `mesh`.
#[derive(Clone, Debug)]
pub(super) struct Slice {
    /// The part.
    pub(super) mesh: TriMesh,
    /// Per vertex the two vertices of the scan and the factors whose weighted sum it is.
    pub(super) origins: Vec<[(VertexId, f64); 2]>,
    /// Which vertices are on the cut.
    pub(super) on_cut: Vec<bool>,
    /// Which vertices the scan shows; the others are filled.
    pub(super) is_seen: Vec<bool>,
    /// The adjacency of `mesh`, once it was asked for.
    adjacency: OnceCell<Adjacency>,
}

impl Slice {
    pub(super) fn new(
        mesh: TriMesh,
        origins: Vec<[(VertexId, f64); 2]>,
        on_cut: Vec<bool>,
        is_seen: Vec<bool>,
    ) -> Self {
        Self { mesh, origins, on_cut, is_seen, adjacency: OnceCell::new() }
    }

    /// The adjacency of the part.
    pub(super) fn adjacency(&self) -> &Adjacency {
        self.adjacency.get_or_init(|| Adjacency::prepare(&self.mesh))
    }

    /// Treats vertices cut beside a hole of the scan as the border of that hole.
    pub(super) fn with_hems_only(mut self, beside_hole: &PerVertex<bool>) -> Self {
        for (on_cut, origin) in self.on_cut.iter_mut().zip(&self.origins) {
            *on_cut &= !origin.iter().any(|&(v, _)| beside_hole[v]);
        }
        self
    }

    /// Marks as not seen what comes only from vertices that the scan does not show.
    pub(super) fn seen_where(mut self, shows: impl Fn(VertexId) -> bool) -> Self {
        for (is_seen, origin) in self.is_seen.iter_mut().zip(&self.origins) {
            *is_seen = origin.iter().any(|&(v, factor)| factor > 0.0 && shows(v));
        }
        self
    }

    /// The faces marked in `keep`, with their vertices.
    pub(super) fn part(&self, keep: &crate::geometry::PerFace<bool>) -> Self {
        let (mesh, whole_from_part) = self.mesh.part(keep);
        Self::new(
            mesh,
            whole_from_part.iter().map(|v| self.origins[v.index()]).collect(),
            whole_from_part.iter().map(|v| self.on_cut[v.index()]).collect(),
            whole_from_part.iter().map(|v| self.is_seen[v.index()]).collect(),
        )
    }
}

/// Cuts along the zero line of `field`, which is linear on each face, and keeps the positive side.
pub(super) fn slice(mesh: &TriMesh, field: &PerVertex<f64>) -> Result<Slice, MeshError> {
    let field = snapped(mesh, field);
    let mut builder = Builder::new(mesh, &field);
    for face in mesh.faces().iter() {
        let values = face.map(|v| field[v]);
        if values.iter().all(|&s| s <= 0.0) {
            continue;
        }
        let mut polygon: Vec<u32> = Vec::with_capacity(4);
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            if field[a] >= 0.0 {
                polygon.push(builder.kept(a));
            }
            if field[a] * field[b] < 0.0 {
                polygon.push(builder.crossing(a, b));
            }
        }
        builder.fill(&polygon);
    }
    builder.finish()
}

/// Values whose zero line passes exactly through the corners that it would pass closely.
fn snapped(mesh: &TriMesh, field: &PerVertex<f64>) -> PerVertex<f64> {
    let mut snapped = field.clone();
    for face in mesh.faces().iter() {
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            if field[a] * field[b] < 0.0 {
                let t = field[a] / (field[a] - field[b]);
                if t < SNAP_PER_EDGE {
                    snapped[a] = 0.0;
                } else if t > 1.0 - SNAP_PER_EDGE {
                    snapped[b] = 0.0;
                }
            }
        }
    }
    snapped
}

struct Builder<'a> {
    mesh: &'a TriMesh,
    field: &'a PerVertex<f64>,
    points: Vec<Point>,
    origins: Vec<[(VertexId, f64); 2]>,
    on_cut: Vec<bool>,
    from_vertex: Vec<u32>,
    /// Only used for lookup, so its order does not matter.
    from_edge: HashMap<(VertexId, VertexId), u32>,
    faces: Vec<[u32; 3]>,
}

impl<'a> Builder<'a> {
    fn new(mesh: &'a TriMesh, field: &'a PerVertex<f64>) -> Self {
        Self {
            mesh,
            field,
            points: Vec::new(),
            origins: Vec::new(),
            on_cut: Vec::new(),
            from_vertex: vec![u32::MAX; mesh.vertex_count()],
            from_edge: HashMap::new(),
            faces: Vec::new(),
        }
    }

    fn push(&mut self, point: Point, origin: [(VertexId, f64); 2], on_cut: bool) -> u32 {
        self.points.push(point);
        self.origins.push(origin);
        self.on_cut.push(on_cut);
        (self.points.len() - 1) as u32
    }

    fn kept(&mut self, v: VertexId) -> u32 {
        if self.from_vertex[v.index()] == u32::MAX {
            self.from_vertex[v.index()] = self.push(self.mesh.points()[v], [(v, 1.0), (v, 0.0)], self.field[v] == 0.0);
        }
        self.from_vertex[v.index()]
    }

    fn crossing(&mut self, a: VertexId, b: VertexId) -> u32 {
        // The same arithmetic for both faces.
        let (a, b) = (a.min(b), a.max(b));
        if let Some(&there) = self.from_edge.get(&(a, b)) {
            return there;
        }
        let t = self.field[a] / (self.field[a] - self.field[b]);
        let (p, q) = (self.mesh.points()[a], self.mesh.points()[b]);
        let new = self.push(p + (q - p) * t, [(a, 1.0 - t), (b, t)], true);
        self.from_edge.insert((a, b), new);
        new
    }

    fn fill(&mut self, polygon: &[u32]) {
        let at = |i: usize| self.points[polygon[i] as usize];
        match polygon.len() {
            3 => self.faces.push([polygon[0], polygon[1], polygon[2]]),
            4 if (at(0) - at(2)).norm() <= (at(1) - at(3)).norm() => {
                self.faces.push([polygon[0], polygon[1], polygon[2]]);
                self.faces.push([polygon[0], polygon[2], polygon[3]]);
            }
            4 => {
                self.faces.push([polygon[0], polygon[1], polygon[3]]);
                self.faces.push([polygon[1], polygon[2], polygon[3]]);
            }
            _ => {}
        }
    }

    fn finish(self) -> Result<Slice, MeshError> {
        let faces = self.faces.iter().map(|f| f.map(VertexId)).collect::<crate::geometry::PerFace<_>>();
        let is_seen = vec![true; self.points.len()];
        Ok(Slice::new(TriMesh::try_new(self.points, faces)?, self.origins, self.on_cut, is_seen))
    }
}
