//! All layers of a figure as one surface, so that one search finds what crosses: layers with each other and with
//! themselves.

use crate::geometry::{FaceId, MeshError, PerVertex, Piercing, Point, SurfaceIndex, TriMesh, VertexId};

/// The layers in one mesh, innermost first, as they are exported: every coordinate is an `f32`.
pub(super) struct Sheets {
    /// All vertices and faces.
    pub index: SurfaceIndex,
    /// Per layer its first vertex; then the number of all vertices.
    starts: Vec<usize>,
    /// **Shapes** one entry per vertex.
    layer_of: PerVertex<u16>,
}

impl Sheets {
    /// Joins the layers and rounds their coordinates as the export does.
    pub(super) fn join(layers: &[TriMesh]) -> Result<Self, MeshError> {
        let mut starts = vec![0];
        let (mut points, mut faces, mut layer_of) = (Vec::new(), Vec::new(), Vec::new());
        for (k, layer) in layers.iter().enumerate() {
            let first = points.len();
            points.extend(layer.points().iter().map(rounded));
            let shifted = |v: VertexId| VertexId::from_index(v.index() + first);
            faces.extend(layer.faces().iter().map(|f| f.map(shifted)));
            layer_of.resize(points.len(), k as u16);
            starts.push(points.len());
        }
        let mesh = TriMesh::try_new(points, faces)?;
        Ok(Self { index: SurfaceIndex::prepare(&mesh), starts, layer_of: PerVertex(layer_of) })
    }

    pub(super) fn mesh(&self) -> &TriMesh {
        self.index.mesh()
    }

    pub(super) fn layer_count(&self) -> usize {
        self.starts.len() - 1
    }

    /// The layer of a vertex; 0 is the body.
    pub(super) fn layer_of(&self, v: VertexId) -> usize {
        usize::from(self.layer_of[v])
    }

    /// The layer of a face.
    pub(super) fn layer_of_face(&self, f: FaceId) -> usize {
        self.layer_of(self.mesh().faces()[f][0])
    }

    /// Moves the vertices to other places, rounded as the export does, and gives the faces that moved.
    pub(super) fn move_to(&mut self, points: &PerVertex<Point>) -> Vec<FaceId> {
        let rounded: PerVertex<Point> = points.iter().map(rounded).collect();
        let old = self.mesh();
        let moved = (old.faces().enumerate())
            .filter(|(_, corners)| corners.iter().any(|&v| old.points()[v] != rounded[v]))
            .map(|(f, _)| f)
            .collect();
        let mesh = old.with_points(rounded);
        self.index.follow(&mesh);
        moved
    }

    /// Everything that crosses.
    pub(super) fn piercings(&self) -> Vec<Piercing> {
        let all: Vec<FaceId> = self.mesh().face_ids().collect();
        self.index.piercings(&all)
    }

    /// The id in the joined mesh of a vertex of one layer.
    pub(super) fn vertex(&self, layer: usize, v: VertexId) -> VertexId {
        VertexId::from_index(self.starts[layer] + v.index())
    }

    /// The surfaces of all layers.
    ///
    /// **Requires** the meshes that were joined, for their faces.
    pub(super) fn layers(&self, like: &[TriMesh]) -> Vec<TriMesh> {
        like.iter().enumerate().map(|(k, mesh)| self.layer(k, mesh)).collect()
    }

    /// The surface of one layer.
    ///
    /// **Requires** the mesh that was joined, for its faces.
    pub(super) fn layer(&self, k: usize, like: &TriMesh) -> TriMesh {
        like.with_points(self.mesh().points().0[self.starts[k]..self.starts[k + 1]].to_vec())
    }
}

fn rounded(p: &Point) -> Point {
    Point::from(p.coords.map(|c| f64::from(c as f32)))
}
