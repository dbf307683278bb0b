//! Distances along a surface.

use super::{Adjacency, PerVertex, TriMesh, VertexId};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A distance on the heap. Distances are never negative, so their bits are in the order of the numbers.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct QueuedVertex(Reverse<u64>, Reverse<VertexId>);

/// Distance along the surface from the nearest of `sources`, each with an initial distance (negative ones count as zero);
/// infinite above `max` and in components without a source.
///
/// **Shapes** one entry per vertex, in metres.
///
/// # Panics
/// If `adjacency` is of another mesh, or a source is not one of its vertices.
///
/// Dijkstra's algorithm over edges, extended across faces: from two corners with known distances the third is reached
/// straight through the unfolded face. For one source the result is never shorter than the geodesic by more than
/// rounding, and a few percent longer on coarse meshes.
pub fn geodesic_distances(
    mesh: &TriMesh,
    adjacency: &Adjacency,
    sources: &[(VertexId, f64)],
    max: f64,
) -> PerVertex<f64> {
    adjacency.assert_is_of(mesh);
    let mut distance = PerVertex::filled(f64::INFINITY, mesh.vertex_count());
    let mut settled = PerVertex::filled(false, mesh.vertex_count());
    let mut heap = BinaryHeap::new();
    let reach = |v: VertexId, d: f64, distance: &mut PerVertex<f64>, heap: &mut BinaryHeap<QueuedVertex>| {
        if d < distance[v] && d <= max {
            distance[v] = d;
            heap.push(QueuedVertex(Reverse(d.to_bits()), Reverse(v)));
        }
    };
    for &(v, start) in sources {
        reach(v, start.max(0.0), &mut distance, &mut heap);
    }
    while let Some(QueuedVertex(Reverse(bits), Reverse(v))) = heap.pop() {
        if settled[v] || f64::from_bits(bits) > distance[v] {
            continue;
        }
        settled[v] = true;
        for &w in adjacency.neighbours_of(v) {
            let along = distance[v] + (mesh.points()[w] - mesh.points()[v]).norm();
            reach(w, along, &mut distance, &mut heap);
        }
        for &f in adjacency.faces_of(v) {
            let face = mesh.faces()[f];
            for w in face.into_iter().filter(|&w| w != v && !settled[w]) {
                let Some(u) = face.into_iter().find(|&u| u != v && u != w && settled[u]) else { continue };
                if let Some(across) = across_face(mesh, [v, u, w], distance[v], distance[u]) {
                    reach(w, across, &mut distance, &mut heap);
                }
            }
        }
    }
    distance
}

/// Distance of `w` from a source unfolded across the edge `v u`, if the straight line crosses that edge.
fn across_face(mesh: &TriMesh, [v, u, w]: [VertexId; 3], to_v: f64, to_u: f64) -> Option<f64> {
    let (edge, side) = (mesh.points()[u] - mesh.points()[v], mesh.points()[w] - mesh.points()[v]);
    let length = edge.norm();
    if length <= 0.0 {
        return None;
    }
    // In the plane of the face: v at the origin, u on the x axis, w above it, the source below.
    let w_x = side.dot(&edge) / length;
    let w_y = (side.norm_squared() - w_x * w_x).max(0.0).sqrt();
    let source_x = (to_v * to_v - to_u * to_u + length * length) / (2.0 * length);
    let depth_squared = to_v * to_v - source_x * source_x;
    if depth_squared < 0.0 {
        return None;
    }
    let depth = depth_squared.sqrt();
    if depth + w_y <= 0.0 {
        return None;
    }
    let crossing = source_x + (w_x - source_x) * depth / (depth + w_y);
    (0.0..=length).contains(&crossing).then(|| (w_x - source_x).hypot(w_y + depth))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes_for_tests::sphere;

    #[test]
    fn from_the_pole_of_a_sphere_distance_is_the_polar_angle() {
        let mesh = sphere(40, 60);
        let adjacency = Adjacency::prepare(&mesh);
        // Not the pole of the meridians: there edges alone would do.
        let source = VertexId(1 + 19 * 60);
        let distance = geodesic_distances(&mesh, &adjacency, &[(source, 0.0)], f64::INFINITY);
        let from = mesh.points()[source];
        for (v, p) in mesh.points().enumerate() {
            let truth = from.coords.angle(&p.coords);
            assert!((distance[v] - truth).abs() < 0.02 * truth + 0.01, "{} against {truth}", distance[v]);
        }
    }

    #[test]
    fn beyond_the_limit_and_on_other_parts_it_is_infinite() {
        let mesh = sphere(10, 14);
        let adjacency = Adjacency::prepare(&mesh);
        let distance = geodesic_distances(&mesh, &adjacency, &[(VertexId(0), 0.25)], 1.0);
        assert_eq!(distance[VertexId(0)], 0.25);
        assert!(distance.iter().all(|&d| d <= 1.0 || d.is_infinite()));
        assert!(distance.iter().any(|d| d.is_infinite()) && distance.iter().filter(|d| d.is_finite()).count() > 14);
        assert!(geodesic_distances(&mesh, &adjacency, &[], 9.0).iter().all(|d| d.is_infinite()));
    }

    #[test]
    fn neighbours_never_differ_by_more_than_their_edge() {
        let mesh = sphere(16, 24);
        let adjacency = Adjacency::prepare(&mesh);
        let sources = [(VertexId(5), 0.0), (VertexId(100), 0.3)];
        let distance = geodesic_distances(&mesh, &adjacency, &sources, f64::INFINITY);
        for ([a, b], _) in adjacency.edges() {
            let length = (mesh.points()[*a] - mesh.points()[*b]).norm();
            assert!((distance[*a] - distance[*b]).abs() <= length + 1e-12);
        }
    }

    #[test]
    #[should_panic(expected = "vertices and faces of the adjacency")]
    fn the_adjacency_of_another_mesh_is_a_fault() {
        let other = Adjacency::prepare(&sphere(8, 12));
        geodesic_distances(&sphere(16, 24), &other, &[(VertexId(0), 0.0)], 1.0);
    }
}
