//! Removes noise from a surface and keeps creases.

use crate::geometry::{Adjacency, PerFace, Point, TriMesh, Vec3};
use rayon::prelude::*;

/// Scale of the difference between normals at a crease: the length of their difference (17°).
const CREASE: f64 = 0.3;
/// Number of vertex updates: after ten, hardly anything changes.
const MOVES: usize = 10;

/// Bilateral filtering of the face normals, and the vertices that fit them. Border vertices stay.
///
/// **Source** Zheng, Fu, Au, Tai 2011, "Bilateral normal filtering for mesh denoising", local iterative scheme; vertex
/// update of Sun et al. 2007.
pub(super) fn denoised(mesh: &TriMesh, rounds: usize) -> TriMesh {
    if rounds == 0 {
        return mesh.clone();
    }
    let adjacency = Adjacency::prepare(mesh);
    let on_border = adjacency.boundary_vertices();
    let areas: PerFace<f64> = mesh.face_ids().map(|f| mesh.face_area(f)).collect();
    let mut normals: PerFace<Vec3> = mesh.face_ids().map(|f| mesh.face_normal(f)).collect();
    for _ in 0..rounds {
        let filtered: Vec<Vec3> = (0..mesh.face_count())
            .into_par_iter()
            .map(|f| {
                let f = crate::geometry::FaceId::from_index(f);
                let mut sum = normals[f] * areas[f];
                for g in mesh.faces()[f].iter().flat_map(|&v| adjacency.faces_of(v)).filter(|g| **g != f) {
                    let apart = (normals[f] - normals[*g]).norm_squared() / (CREASE * CREASE);
                    sum += normals[*g] * (areas[*g] * (-0.5 * apart).exp());
                }
                sum.try_normalize(1e-30).unwrap_or(normals[f])
            })
            .collect();
        normals = filtered.into();
    }
    let mut moved = mesh.clone();
    for _ in 0..MOVES {
        let points: Vec<Point> = (0..mesh.vertex_count())
            .into_par_iter()
            .map(|v| {
                let v = crate::geometry::VertexId::from_index(v);
                let (p, around) = (moved.points()[v], adjacency.faces_of(v));
                if on_border[v] || around.is_empty() {
                    return p;
                }
                let pull: Vec3 = around
                    .iter()
                    .map(|&f| {
                        let [a, b, c] = moved.triangle(f);
                        let middle = (a.coords + b.coords + c.coords) / 3.0;
                        normals[f] * normals[f].dot(&(middle - p.coords))
                    })
                    .sum();
                p + pull / around.len() as f64
            })
            .collect();
        moved = moved.with_points(points);
    }
    moved
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_goes_and_a_ridge_stays() {
        let n = 40;
        let ridge = |x: usize| 0.5 * (x as f64 - 19.5).abs();
        let noise = |x: usize, y: usize| 0.12 * ((x * 71 + y * 137) as f64 * 12.9898).sin();
        let points = (0..n * n).map(|i| Point::new((i % n) as f64, (i / n) as f64, ridge(i % n) + noise(i % n, i / n)));
        let mut faces = Vec::new();
        for i in (0..n * (n - 1)).filter(|i| i % n + 1 < n) {
            let [a, b, c, d] = [i, i + 1, i + n, i + n + 1].map(|v| v as u32);
            faces.extend([[a, b, d], [a, d, c]]);
        }
        let mesh = TriMesh::try_from_indices(points.collect(), &faces).unwrap();
        let off = |mesh: &TriMesh| {
            let inner = mesh
                .points()
                .iter()
                .enumerate()
                .filter(|(i, _)| (3..37).contains(&(i % n)) && (3..37).contains(&(i / n)));
            inner.map(|(i, p)| (p.z - ridge(i % n)).abs()).sum::<f64>()
        };
        let after = denoised(&mesh, 5);
        assert!(off(&after) < 0.7 * off(&mesh), "{} of {}", off(&after), off(&mesh));
        assert_eq!(denoised(&mesh, 0), mesh);
    }
}
