//! The bounded, smooth offset for what the pose cannot satisfy: breathing, soft flesh, noise.

use crate::geometry::{Adjacency, PerVertex, TriMesh, VertexId};

/// Offsets along the normals (≤ 0, inward), at least as deep as `required` wherever that is within `greatest`.
///
/// The depth changes over the surface by at most `SLOPE`, so that no vertex is offset alone: the smallest field with that
/// slope above all required depths (an upper envelope of cones), smoothed upward only.
///
/// **Shapes** `required` and the result have one value per vertex.
pub(crate) fn bounded_offsets(mesh: &TriMesh, required: &PerVertex<Option<f64>>, greatest: f64) -> PerVertex<f64> {
    /// Greatest change of depth per length along the surface: 6 mm over 4 cm.
    const SLOPE: f64 = 0.15;
    /// Rounds of smoothing, each over a one-ring of vertices (about 2 cm).
    const ROUNDS: usize = 3;
    let adjacency = Adjacency::prepare(mesh);
    assert_eq!(required.len(), mesh.vertex_count(), "one required offset per vertex");
    let least: Vec<f64> = required.iter().map(|required| required.unwrap_or(0.0).clamp(0.0, greatest)).collect();
    let mut depth = least.clone();
    // Relaxed until nothing rises: reach is greatest / SLOPE = 4 cm, a few rings.
    loop {
        let mut rose = false;
        for i in 0..depth.len() {
            let v = VertexId::from_index(i);
            for &w in adjacency.neighbours_of(v) {
                let offered = depth[w.index()] - SLOPE * (mesh.points()[v] - mesh.points()[w]).norm();
                if offered > depth[i] + 1e-9 {
                    depth[i] = offered;
                    rose = true;
                }
            }
        }
        if !rose {
            break;
        }
    }
    for _ in 0..ROUNDS {
        let before = depth.clone();
        for i in 0..depth.len() {
            let ring = adjacency.neighbours_of(VertexId::from_index(i));
            if !ring.is_empty() {
                let mean = ring.iter().map(|w| before[w.index()]).sum::<f64>() / ring.len() as f64;
                depth[i] = (0.5 * (before[i] + mean)).max(least[i]);
            }
        }
    }
    depth.into_iter().map(|d| -d).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    #[test]
    fn required_offsets_within_the_bound_are_met_and_nothing_exceeds_it() {
        let n = 20;
        let points = (0..n * n).map(|i| Point::new((i % n) as f64 * 0.01, 0.0, (i / n) as f64 * 0.01)).collect();
        let mut faces = Vec::new();
        for r in 0..n - 1 {
            for c in 0..n - 1 {
                let a = (r * n + c) as u32;
                faces.push([a, a + n as u32, a + 1]);
                faces.push([a + 1, a + n as u32, a + n as u32 + 1]);
            }
        }
        let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
        let mut required = PerVertex::filled(None, n * n);
        required.0[210] = Some(0.004);
        required.0[150] = Some(0.05);
        required.0[10] = Some(-0.01);
        let offsets = bounded_offsets(&mesh, &required, 0.006);
        assert!(offsets.0[210] <= -0.004 + 1e-12);
        assert!((offsets.0[150] + 0.006).abs() < 1e-9);
        assert!(offsets.iter().all(|o| (-0.006 - 1e-12..=0.0).contains(o)));
        assert!(offsets.0[211] < -0.001, "a neighbour is drawn in too");
    }
}
