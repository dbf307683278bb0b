//! Laplacians of a mesh.

use super::{PerVertex, TriMesh, Vec3, VertexId};

/// Greatest cotangent: cot 1° = 57.3. Otherwise the slivers of fused scans outweigh all other faces.
const GREATEST_COTANGENT: f64 = 57.3;
/// Least weight of an edge, positive so that no vertex is isolated and the matrix stays positive semidefinite with obtuse
/// angles. Dimensionless, 1e-4 of a usual weight.
const LEAST_WEIGHT: f64 = 1e-4;

/// The Laplacian of a mesh: a symmetric positive semidefinite matrix `V × V` whose rows sum to zero.
///
/// **Guarantees** `triplets` come in an order that depends on the faces alone, so a factorisation may be reused for the
/// same faces over moved points.
#[derive(Clone, Debug)]
pub struct Laplacian {
    /// `V + 2E` times (row, column, value), both triangles: the diagonal first, then each edge twice. No entry comes twice.
    pub triplets: Vec<(usize, usize, f64)>,
    /// V lumped masses: a third of the area around it in m², or 1 for the uniform Laplacian.
    pub mass: PerVertex<f64>,
}

/// Cotangent weights `(cot α + cot β) / 2` (Pinkall & Polthier 1993), clamped for noisy meshes.
///
/// Vertices without faces have an empty row and no mass; isolate them or give them weight before factorising.
pub fn cotangent_laplacian(mesh: &TriMesh) -> Laplacian {
    let mut half_edges = Vec::with_capacity(mesh.face_count() * 3);
    for f in mesh.face_ids() {
        let (corners, points) = (mesh.faces()[f], mesh.triangle(f));
        for k in 0..3 {
            let (u, v) = (points[(k + 1) % 3] - points[k], points[(k + 2) % 3] - points[k]);
            let sine = u.cross(&v).norm().max(f64::MIN_POSITIVE);
            let cotangent = (u.dot(&v) / sine).clamp(-GREATEST_COTANGENT, GREATEST_COTANGENT);
            half_edges.push((ordered(corners[(k + 1) % 3], corners[(k + 2) % 3]), 0.5 * cotangent));
        }
    }
    assemble(half_edges, mesh.vertex_areas(), |sum| sum.max(LEAST_WEIGHT))
}

/// The uniform Laplacian: weight 1 for every edge, independent of the mesh's shape.
pub fn uniform_laplacian(mesh: &TriMesh) -> Laplacian {
    let half_edges = mesh.faces().iter().flat_map(|c| (0..3).map(|k| (ordered(c[k], c[(k + 1) % 3]), 1.0))).collect();
    assemble(half_edges, PerVertex::filled(1.0, mesh.vertex_count()), |_| 1.0)
}

fn ordered(a: VertexId, b: VertexId) -> (u32, u32) {
    (a.0.min(b.0), a.0.max(b.0))
}

fn assemble(
    mut half_edges: Vec<((u32, u32), f64)>,
    mass: PerVertex<f64>,
    weight_of_sum: impl Fn(f64) -> f64,
) -> Laplacian {
    half_edges.retain(|(ends, _)| ends.0 != ends.1);
    // Stable, so that sums are taken in the order of faces.
    half_edges.sort_by_key(|&(ends, _)| ends);
    let mut triplets: Vec<(usize, usize, f64)> = (0..mass.len()).map(|v| (v, v, 0.0)).collect();
    for group in half_edges.chunk_by(|a, b| a.0 == b.0) {
        let (i, j) = (group[0].0.0 as usize, group[0].0.1 as usize);
        let weight = weight_of_sum(group.iter().map(|half| half.1).sum());
        triplets.push((i, j, -weight));
        triplets.push((j, i, -weight));
        triplets[i].2 += weight;
        triplets[j].2 += weight;
    }
    Laplacian { triplets, mass }
}

impl Laplacian {
    /// The matrix times one value per vertex.
    ///
    /// **Shapes** `V` in and out.
    ///
    /// # Panics
    /// If there is not one value per vertex.
    pub fn apply(&self, values: &[f64]) -> Vec<f64> {
        assert_eq!(values.len(), self.mass.len(), "one value per vertex");
        let mut product = vec![0.0; self.mass.len()];
        for &(row, column, value) in &self.triplets {
            product[row] += value * values[column];
        }
        product
    }

    /// The matrix times one vector per vertex.
    ///
    /// **Shapes** `V × 3` in and out.
    ///
    /// # Panics
    /// If there is not one vector per vertex.
    pub fn apply_to_vectors(&self, values: &[Vec3]) -> Vec<Vec3> {
        assert_eq!(values.len(), self.mass.len(), "one vector per vertex");
        let mut product = vec![Vec3::zeros(); self.mass.len()];
        for &(row, column, value) in &self.triplets {
            product[row] += value * values[column];
        }
        product
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::geometry::shapes_for_tests::{noise, sphere};

    fn noisy_sphere() -> TriMesh {
        let mut next = noise(2);
        let mut shake: Vec<Vec3> = Vec::new();
        let smooth = sphere(20, 30);
        for _ in 0..smooth.vertex_count() {
            shake.push(Vec3::new(next(), next(), next()) * 0.08);
        }
        smooth.with_points(smooth.points().iter().zip(shake).map(|(p, s)| p + s).collect::<Vec<Point>>())
    }

    #[test]
    fn constants_are_in_the_null_space_and_energy_is_never_negative() {
        let mut next = noise(4);
        let mesh = noisy_sphere();
        for laplacian in [cotangent_laplacian(&mesh), uniform_laplacian(&mesh)] {
            let of_ones = laplacian.apply(&vec![1.0; mesh.vertex_count()]);
            assert!(of_ones.iter().all(|v| v.abs() < 1e-9));
            for _ in 0..20 {
                let values: Vec<f64> = (0..mesh.vertex_count()).map(|_| next()).collect();
                let energy: f64 = laplacian.apply(&values).iter().zip(&values).map(|(l, v)| l * v).sum();
                assert!(energy > 0.0);
            }
        }
    }

    #[test]
    fn coordinates_are_harmonic_inside_a_flat_mesh() {
        let mut next = noise(6);
        let n = 9;
        let points: Vec<Point> = (0..n * n)
            .map(|i| ((i % n) as f64, (i / n) as f64))
            .map(|(x, y)| Point::new(x - 0.5 * y + 0.1 * next(), 0.87 * y + 0.1 * next(), 0.0))
            .collect();
        let mut faces = Vec::new();
        for y in 0..n - 1 {
            for x in 0..n - 1 {
                let at = |x: usize, y: usize| (y * n + x) as u32;
                faces.push([at(x, y), at(x + 1, y), at(x + 1, y + 1)]);
                faces.push([at(x, y), at(x + 1, y + 1), at(x, y + 1)]);
            }
        }
        let mesh = TriMesh::try_from_indices(points.clone(), &faces).unwrap();
        let laplacian = cotangent_laplacian(&mesh);
        let curvature = laplacian.apply_to_vectors(&points.iter().map(|p| p.coords).collect::<Vec<_>>());
        for y in 1..n - 1 {
            for x in 1..n - 1 {
                assert!(curvature[y * n + x].norm() < 1e-9);
            }
        }
    }

    #[test]
    fn on_the_unit_sphere_the_mean_curvature_normal_is_twice_the_normal() {
        let mesh = sphere(60, 120);
        let laplacian = cotangent_laplacian(&mesh);
        let curvature = laplacian.apply_to_vectors(&mesh.points().iter().map(|p| p.coords).collect::<Vec<_>>());
        let total: Vec3 = curvature.iter().sum();
        assert!(total.norm() < 1e-9, "inner forces cancel");
        let outward: f64 = curvature.iter().zip(mesh.points().iter()).map(|(c, p)| c.dot(&p.coords)).sum();
        assert!(
            (outward / mesh.area() - 2.0).abs() < 0.01,
            "the Dirichlet energy of the coordinates is twice the area"
        );
    }
}
