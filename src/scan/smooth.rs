//! Taubin smoothing.

use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, Vec3, VertexId};

/// The shrinking step (values of Taubin 1995, which preserve waves of ten edges).
const LAMBDA: f64 = 0.5;
/// The inflating step.
const MU: f64 = -0.53;

/// Taubin's λ|μ smoothing with equal weights. Border vertices are smoothed along their border only, so that holes keep
/// their shape.
///
/// **Source** Taubin 1995, "A signal processing approach to fair surface design".
pub(super) fn smoothed(mesh: &TriMesh, adjacency: &Adjacency, passes: usize) -> TriMesh {
    let on_border = adjacency.boundary_vertices();
    let mut along_border: PerVertex<Vec<VertexId>> = PerVertex::filled(Vec::new(), mesh.vertex_count());
    for &[a, b] in adjacency.boundary_edges() {
        along_border[a].push(b);
        along_border[b].push(a);
    }
    let neighbours = |v: VertexId| if on_border[v] { along_border[v].as_slice() } else { adjacency.neighbours_of(v) };
    let mut points = mesh.points().clone();
    for _ in 0..passes {
        for factor in [LAMBDA, MU] {
            let moved: PerVertex<Point> = points
                .enumerate()
                .map(|(v, p)| {
                    let around = neighbours(v);
                    if around.is_empty() {
                        return *p;
                    }
                    let sum: Vec3 = around.iter().map(|&w| points[w] - p).sum();
                    p + sum * (factor / around.len() as f64)
                })
                .collect();
            points = moved;
        }
    }
    mesh.with_points(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane of n × n vertices with `height` on it.
    fn plane(n: usize, height: impl Fn(usize, usize) -> f64) -> TriMesh {
        let points = (0..n * n).map(|i| Point::new((i % n) as f64, (i / n) as f64, height(i % n, i / n))).collect();
        let mut faces = Vec::new();
        for y in 0..n - 1 {
            for x in 0..n - 1 {
                let at = |x: usize, y: usize| (y * n + x) as u32;
                faces.push([at(x, y), at(x + 1, y), at(x + 1, y + 1)]);
                faces.push([at(x, y), at(x + 1, y + 1), at(x, y + 1)]);
            }
        }
        TriMesh::try_from_indices(points, &faces).unwrap()
    }

    fn height_squared(mesh: &TriMesh) -> f64 {
        mesh.points().iter().map(|p| p.z * p.z).sum()
    }

    #[test]
    fn noise_goes_long_waves_stay_and_the_border_keeps_its_line() {
        let noisy = plane(30, |x, y| 0.1 * ((x * 7 + y * 13) as f64 * 12.9).sin());
        let after = smoothed(&noisy, &Adjacency::prepare(&noisy), 4);
        assert!(height_squared(&after) < 0.4 * height_squared(&noisy));
        let wave = plane(30, |x, _| 0.5 * (x as f64 * std::f64::consts::TAU / 29.0).sin());
        let after = smoothed(&wave, &Adjacency::prepare(&wave), 4);
        assert!((height_squared(&after) / height_squared(&wave) - 1.0).abs() < 0.05);
        for p in
            after.points().iter().zip(wave.points().iter()).filter(|(_, q)| q.x == 0.0 && (9.0..20.0).contains(&q.y))
        {
            assert!(p.0.x.abs() < 1e-9, "the border stays straight");
        }
    }
}
