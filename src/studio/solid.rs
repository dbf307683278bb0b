//! A surface with a calm idea of outside: its normals averaged with their neighbours', so that a sliver folded the
//! wrong way does not open a door for cloth.

use crate::geometry::{Adjacency, PerVertex, Point, SurfaceIndex, SurfacePoint, TriMesh, Vec3, VertexId};
use std::sync::Arc;

/// Rounds of averaging: a few edges wide, narrower than a finger.
const ROUNDS: usize = 4;

/// A surface that cloth may not pass.
pub(super) struct Solid {
    index: SurfaceIndex,
    normals: PerVertex<Vec3>,
    adjacency: Arc<Adjacency>,
    on_rim: Arc<PerVertex<bool>>,
}

/// The normals of a surface, each averaged with its neighbours'.
pub(super) fn calm_normals(mesh: &TriMesh) -> PerVertex<Vec3> {
    calmed(mesh, &Adjacency::prepare(mesh))
}

fn calmed(mesh: &TriMesh, adjacency: &Adjacency) -> PerVertex<Vec3> {
    let mut normals = mesh.vertex_normals();
    for _ in 0..ROUNDS {
        normals = mesh
            .vertex_ids()
            .map(|v| {
                let sum = normals[v] + adjacency.neighbours_of(v).iter().map(|&n| normals[n]).sum::<Vec3>();
                sum.try_normalize(1e-9).unwrap_or(normals[v])
            })
            .collect();
    }
    normals
}

impl Solid {
    pub(super) fn prepare(mesh: &TriMesh) -> Self {
        let adjacency = Arc::new(Adjacency::prepare(mesh));
        let on_rim = Arc::new(adjacency.boundary_vertices());
        Self { index: SurfaceIndex::prepare(mesh), normals: calmed(mesh, &adjacency), adjacency, on_rim }
    }

    /// The same surface, its vertices elsewhere.
    pub(super) fn moved(&self, points: &[Point]) -> Self {
        let mesh = self.mesh().with_points(points.to_vec());
        let normals = calmed(&mesh, &self.adjacency);
        let (adjacency, on_rim) = (self.adjacency.clone(), self.on_rim.clone());
        Self { index: SurfaceIndex::prepare(&mesh), normals, adjacency, on_rim }
    }

    /// The closest point no farther than `reach`, and the calm normal there.
    pub(super) fn closest(&self, p: &Point, reach: f64) -> Option<(SurfacePoint, Vec3)> {
        let near = self.index.closest_within(p, reach)?;
        let corners = self.index.mesh().faces()[near.face];
        let normal: Vec3 = corners.iter().zip(near.barycentric).map(|(&v, w)| self.normals[v] * w).sum();
        Some((near, normal.try_normalize(1e-9)?))
    }

    /// The calm normal at a vertex.
    pub(super) fn normal(&self, v: VertexId) -> Vec3 {
        self.normals[v]
    }

    /// Whether a point of the surface lies on its rim, where it ends.
    pub(super) fn ends_at(&self, near: &SurfacePoint) -> bool {
        let corners = self.mesh().faces()[near.face];
        corners.iter().zip(near.barycentric).all(|(&v, w)| w < 1e-3 || self.on_rim[v])
    }

    /// The surface itself.
    pub(super) fn mesh(&self) -> &TriMesh {
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
        let solid = Solid::prepare(&mesh);
        for x in 0..40 {
            let p = Point::new(1.0 + 0.2 * f64::from(x), 5.1, 0.3);
            let (near, normal) = solid.closest(&p, 1.0).unwrap();
            assert!(normal.z > 0.5 && (p - near.point).dot(&normal) > 0.0);
        }
    }
}
