//! Vertex normals averaged over the neighbourhood.

use super::{Adjacency, PerVertex, TriMesh, Vec3};

/// The vertex normals, averaged `rounds` times with those of their neighbours: a sliver that is folded the wrong way
/// does not turn them.
///
/// **Shapes** one unit vector per vertex of `mesh`.
///
/// # Panics
/// If `adjacency` is of another mesh.
pub fn smoothed_normals(mesh: &TriMesh, adjacency: &Adjacency, rounds: usize) -> PerVertex<Vec3> {
    adjacency.assert_is_of(mesh);
    let mut normals = mesh.vertex_normals();
    for _ in 0..rounds {
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
