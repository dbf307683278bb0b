//! Fewer vertices on the same surface.

use super::{Adjacency, PerFace, PerVertex, TriMesh, VertexId};
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashSet};

/// A distance on the heap with its vertex and source. Distances are never negative, so their bits are in the order of the numbers.
type QueuedClaim = Reverse<(u64, VertexId, VertexId)>;

/// The mesh with some of its vertices, about `spacing` metres apart along it, for queries that need no fine detail.
///
/// Returns it with the vertex of `mesh` for each of its vertices, in ascending order.
///
/// **Shapes** the map has one entry per vertex of the result.
///
/// **Guarantees** sheets that touch are not joined; borders stay, at the spacing; parts smaller than the spacing may be
/// lost. No face appears twice.
pub fn thinned(mesh: &TriMesh, spacing: f64) -> (TriMesh, PerVertex<VertexId>) {
    let adjacency = Adjacency::prepare(mesh);
    let kept = spread_along(mesh, &adjacency, spacing);
    let nearest = nearest_along(mesh, &adjacency, &kept);
    let mut seen = HashSet::new();
    let faces: Vec<[VertexId; 3]> = mesh
        .faces()
        .iter()
        .filter_map(|corners| {
            let [a, b, c] = corners.map(|v| nearest[v]);
            let mut key = [a?, b?, c?];
            key.sort_unstable();
            (key[0] != key[1] && key[1] != key[2] && seen.insert(key)).then_some([a?, b?, c?])
        })
        .collect::<Vec<_>>();
    let coarse = mesh.with_faces(faces);
    coarse.part(&PerFace::filled(true, coarse.face_count()))
}

/// Vertices such that no two are connected within `spacing` and every other vertex is within it of one; border vertices
/// first.
fn spread_along(mesh: &TriMesh, adjacency: &Adjacency, spacing: f64) -> Vec<VertexId> {
    let on_rim = adjacency.boundary_vertices();
    let mut claimed = PerVertex::filled(false, mesh.vertex_count());
    let mut kept = Vec::new();
    let mut near = Vec::new();
    let rim_first = mesh.vertex_ids().filter(|&v| on_rim[v]).chain(mesh.vertex_ids().filter(|&v| !on_rim[v]));
    for v in rim_first {
        if claimed[v] {
            continue;
        }
        kept.push(v);
        claimed[v] = true;
        near.push(v);
        // Paths through vertices claimed by others are not followed; the rest is claimed by others too.
        while let Some(u) = near.pop() {
            for &w in adjacency.neighbours_of(u) {
                if !claimed[w] && (mesh.points()[w] - mesh.points()[v]).norm() < spacing {
                    claimed[w] = true;
                    near.push(w);
                }
            }
        }
    }
    kept
}

/// Of the kept vertices the nearest to each, along edges.
fn nearest_along(mesh: &TriMesh, adjacency: &Adjacency, kept: &[VertexId]) -> PerVertex<Option<VertexId>> {
    let mut nearest = PerVertex::filled(None, mesh.vertex_count());
    let mut heap: BinaryHeap<QueuedClaim> = kept.iter().map(|&v| Reverse((0, v, v))).collect();
    while let Some(Reverse((bits, v, from))) = heap.pop() {
        if nearest[v].is_some() {
            continue;
        }
        nearest[v] = Some(from);
        for &w in adjacency.neighbours_of(v).iter().filter(|&&w| nearest[w].is_none()) {
            let along = f64::from_bits(bits) + (mesh.points()[w] - mesh.points()[v]).norm();
            heap.push(Reverse((along.to_bits(), w, from)));
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes_for_tests::sphere;
    use crate::geometry::{Point, SurfaceIndex};

    #[test]
    fn a_closed_surface_stays_closed_and_where_it_is() {
        const SPACING: f64 = 0.15;
        let mesh = sphere(60, 90);
        let (thin, whole_from_thin) = thinned(&mesh, SPACING);
        assert!(thin.vertex_count() * 4 < mesh.vertex_count(), "{} vertices", thin.vertex_count());
        assert!(Adjacency::prepare(&thin).boundary_edges().is_empty());
        for (v, p) in thin.points().enumerate() {
            assert_eq!(*p, mesh.points()[whole_from_thin[v]]);
        }
        // No place is further off than an edge of twice the spacing cuts a corner.
        let index = SurfaceIndex::prepare(&thin);
        let worst = mesh.points().iter().map(|p| index.closest(p).distance).fold(0.0, f64::max);
        assert!(worst < SPACING * SPACING, "{worst}");
        assert!(thin.signed_volume() > 0.95 * mesh.signed_volume());
        assert!(thin.face_ids().all(|f| thin.area_vector(f).dot(&thin.triangle(f)[0].coords) > 0.0), "turned over");
    }

    #[test]
    fn sheets_that_touch_stay_apart_and_rims_stay() {
        let sheet = |height: f64| {
            let points = (0..400).map(move |i| Point::new(f64::from(i % 20), height, f64::from(i / 20)));
            points.collect::<Vec<_>>()
        };
        let quads = (0..19u32).flat_map(|j| (0..19u32).map(move |i| 20 * j + i));
        let one: Vec<[u32; 3]> = quads.flat_map(|q| [[q, q + 20, q + 1], [q + 1, q + 20, q + 21]]).collect();
        let both: Vec<[u32; 3]> = one.iter().copied().chain(one.iter().map(|f| f.map(|v| v + 400))).collect();
        let mesh = TriMesh::try_from_indices([sheet(0.0), sheet(0.001)].concat(), &both).unwrap();
        let (thin, _) = thinned(&mesh, 3.0);
        for face in thin.face_ids() {
            let [a, b, c] = thin.triangle(face);
            assert!(a.y == b.y && b.y == c.y, "a face from sheet to sheet");
        }
        assert!((thin.area() - mesh.area()).abs() < 0.02 * mesh.area(), "{} of {}", thin.area(), mesh.area());
    }

    #[test]
    fn what_is_smaller_than_the_spacing_may_be_lost_and_nothing_breaks() {
        for (count, faces) in [(0, vec![]), (3, vec![]), (3, vec![[0, 1, 2]]), (4, vec![[0, 1, 2], [2, 1, 3]])] {
            let points = (0..count).map(|i| Point::new(f64::from(i % 2), f64::from(i / 2), 0.0)).collect();
            let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
            assert_eq!(thinned(&mesh, 9.0).0.face_count(), 0);
            assert_eq!(thinned(&mesh, 0.0).0.face_count(), faces.len());
        }
    }
}
