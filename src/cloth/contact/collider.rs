//! A surface that cloth collides with. Its normals are averaged with their neighbours', so that cloth does not pass
//! through at a sliver that is folded the wrong way.

use crate::geometry::{
    Adjacency, PerVertex, Point, SurfaceIndex, SurfacePoint, TriMesh, Vec3, VertexId, smoothed_normals,
};
use std::sync::Arc;

/// Rounds of averaging the normals: a few edges wide, narrower than a finger.
const NORMAL_ROUNDS: usize = 4;

/// A surface that cloth may not pass: the body or another layer, closed or open.
pub struct Collider {
    index: SurfaceIndex,
    normals: PerVertex<Vec3>,
    adjacency: Arc<Adjacency>,
    on_boundary: Arc<PerVertex<bool>>,
}

impl Collider {
    /// Builds the search tree and the normals.
    pub fn prepare(mesh: &TriMesh) -> Self {
        let adjacency = Arc::new(Adjacency::prepare(mesh));
        let on_boundary = Arc::new(adjacency.boundary_vertices());
        Self {
            index: SurfaceIndex::prepare(mesh),
            normals: smoothed_normals(mesh, &adjacency, NORMAL_ROUNDS),
            adjacency,
            on_boundary,
        }
    }

    /// This surface with its vertices moved to `points` (V × 3, metres).
    ///
    /// **Requires** one point per vertex.
    pub(in crate::cloth) fn moved(&self, points: &[Point]) -> Self {
        let mesh = self.mesh().with_points(points.to_vec());
        let normals = smoothed_normals(&mesh, &self.adjacency, NORMAL_ROUNDS);
        let (adjacency, on_boundary) = (self.adjacency.clone(), self.on_boundary.clone());
        Self { index: SurfaceIndex::prepare(&mesh), normals, adjacency, on_boundary }
    }

    /// The closest point no farther than `reach` metres, and the smoothed normal there.
    pub fn closest(&self, p: &Point, reach: f64) -> Option<(SurfacePoint, Vec3)> {
        let near = self.index.closest_within(p, reach)?;
        let corners = self.index.mesh().faces()[near.face];
        let normal: Vec3 = corners.iter().zip(near.barycentric).map(|(&v, w)| self.normals[v] * w).sum();
        Some((near, normal.try_normalize(1e-9)?))
    }

    /// The smoothed normal at a vertex.
    pub(in crate::cloth) fn normal(&self, v: VertexId) -> Vec3 {
        self.normals[v]
    }

    /// Whether a point of the surface lies on its boundary.
    pub(in crate::cloth) fn is_on_boundary(&self, near: &SurfacePoint) -> bool {
        let corners = self.mesh().faces()[near.face];
        corners.iter().zip(near.barycentric).all(|(&v, w)| w < 1e-3 || self.on_boundary[v])
    }

    /// The surface.
    pub fn mesh(&self) -> &TriMesh {
        self.index.mesh()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vertex_folded_through_its_neighbours_still_points_outward() {
        let n = 12;
        let mut points = Vec::new();
        for i in 0..n * n {
            points.push(Point::new((i % n) as f64, (i / n) as f64, 0.0));
        }
        let mut faces = Vec::new();
        for y in 0..n - 1 {
            for x in 0..n - 1 {
                let a = (x + n * y) as u32;
                let m = n as u32;
                faces.extend([[a, a + 1, a + m + 1], [a, a + m + 1, a + m]]);
            }
        }
        // One vertex pulled two cells sideways: some of its triangles turn over.
        points[5 + n * 5] += Vec3::new(2.2, 0.0, 0.0);
        let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
        assert!(mesh.face_ids().any(|f| mesh.face_normal(f).z < 0.0), "the fold is there");
        let collider = Collider::prepare(&mesh);
        for x in 0..40 {
            let p = Point::new(1.0 + 0.2 * f64::from(x), 5.1, 0.3);
            let (near, normal) = collider.closest(&p, 1.0).unwrap();
            assert!(normal.z > 0.5 && (p - near.point).dot(&normal) > 0.0);
        }
    }
}
