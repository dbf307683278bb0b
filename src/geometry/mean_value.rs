//! Barycentric coordinates of a point inside a closed mesh.

use super::{PerVertex, Point, TriMesh};
use std::f64::consts::PI;

/// Angles (radians) and sines below this are zero: the point is on a vertex, in a face or in a face's plane. A body's joint
/// is never within a nanometre of its skin.
const VANISHING: f64 = 1e-9;

/// Mean value coordinates of `x`: one weight per vertex, with sum 1, such that the weighted mean of the vertices is `x`.
///
/// **Requires** a closed mesh and `x` inside or outside of it; on an open mesh the sum is still 1, but the mean is biased
/// towards the existing surface. All weights are zero for a mesh without faces.
///
/// **Source** Ju, Schaefer & Warren 2005, "Mean value coordinates for closed triangular meshes", figure 4.
pub fn mean_value_coordinates(mesh: &TriMesh, x: &Point) -> PerVertex<f64> {
    let mut weights = PerVertex::filled(0.0, mesh.vertex_count());
    let distances: Vec<f64> = mesh.points().iter().map(|p| (p - x).norm()).collect();
    let scale = mesh.bounds().map_or(0.0, |b| b.extent().norm());
    let is_used = {
        let mut used = vec![false; mesh.vertex_count()];
        mesh.faces().iter().flatten().for_each(|v| used[v.index()] = true);
        used
    };
    if let Some(v) = mesh.vertex_ids().find(|v| is_used[v.index()] && distances[v.index()] <= VANISHING * scale) {
        weights[v] = 1.0;
        return weights;
    }
    for face in mesh.faces().iter() {
        let d = face.map(|v| distances[v.index()]);
        let u = face.map(|v| (mesh.points()[v] - x) / distances[v.index()]);
        // The angle at x opposite of corner i; by the half-angle tangent, exact for small and for straight angles.
        let theta: [f64; 3] = std::array::from_fn(|i| {
            let (a, b) = (u[(i + 1) % 3], u[(i + 2) % 3]);
            2.0 * (a - b).norm().atan2((a + b).norm())
        });
        let half = 0.5 * (theta[0] + theta[1] + theta[2]);
        let next = |i: usize| (i + 1) % 3;
        let last = |i: usize| (i + 2) % 3;
        if PI - half < VANISHING {
            // x is in this face: use barycentric coordinates.
            let mut flat = PerVertex::filled(0.0, mesh.vertex_count());
            for i in 0..3 {
                flat[face[i]] += theta[i].sin() * d[last(i)] * d[next(i)];
            }
            return normalised(flat);
        }
        let sine = theta.map(f64::sin);
        if sine.iter().any(|s| s.abs() < VANISHING) {
            continue;
        }
        let side = u[0].dot(&u[1].cross(&u[2])).signum();
        let c: [f64; 3] = std::array::from_fn(|i| {
            (2.0 * half.sin() * (half - theta[i]).sin() / (sine[next(i)] * sine[last(i)]) - 1.0).clamp(-1.0, 1.0)
        });
        let s = c.map(|c| side * (1.0 - c * c).sqrt());
        if s.iter().any(|s| s.abs() < VANISHING) {
            // x is in the plane of the face, outside it: the face covers no part of the sphere.
            continue;
        }
        for i in 0..3 {
            weights[face[i]] += (theta[i] - c[next(i)] * theta[last(i)] - c[last(i)] * theta[next(i)])
                / (d[i] * sine[next(i)] * s[last(i)]);
        }
    }
    normalised(weights)
}

fn normalised(mut weights: PerVertex<f64>) -> PerVertex<f64> {
    let sum: f64 = weights.iter().sum();
    if sum != 0.0 {
        weights.0.iter_mut().for_each(|w| *w /= sum);
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;
    use crate::geometry::shapes_for_tests::{cube, noise, sphere};

    fn mean(mesh: &TriMesh, weights: &PerVertex<f64>) -> Point {
        mesh.points().iter().zip(weights.iter()).fold(Point::origin(), |m, (p, w)| m + p.coords * *w)
    }

    #[test]
    fn the_weighted_mean_of_the_vertices_is_the_point() {
        let mut next = noise(8);
        let dented = sphere(14, 20).map_points(|p| p + Vec3::new(0.0, 0.3 * p.x.sin(), 0.2 * (3.0 * p.y).cos()));
        for mesh in [cube(), sphere(12, 16), dented] {
            for _ in 0..50 {
                let x = Point::new(next(), next(), next());
                let weights = mean_value_coordinates(&mesh, &x);
                assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-9);
                assert!((mean(&mesh, &weights) - x).norm() < 1e-6, "{x}: {}", mean(&mesh, &weights));
            }
        }
    }

    #[test]
    fn on_a_vertex_and_in_a_face_too() {
        let mesh = cube();
        let corner = mesh.points().0[5];
        assert_eq!(mean_value_coordinates(&mesh, &corner).0, [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
        for x in [Point::new(0.2, 0.7, 0.0), Point::new(0.5, 0.5, 1.0), Point::new(1.0, 0.25, 0.5)] {
            let weights = mean_value_coordinates(&mesh, &x);
            assert!((mean(&mesh, &weights) - x).norm() < 1e-6);
            assert!(weights.iter().all(|&w| w > -1e-9));
        }
    }

    #[test]
    fn inside_of_a_convex_mesh_all_weights_are_positive() {
        let mesh = sphere(10, 14);
        let mut next = noise(1);
        for _ in 0..30 {
            let x = Point::new(0.5 * next(), 0.5 * next(), 0.5 * next());
            assert!(mean_value_coordinates(&mesh, &x).iter().all(|&w| w > 0.0));
        }
    }
}
