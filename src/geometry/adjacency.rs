//! Mesh adjacency.

use super::{FaceId, PerFace, PerVertex, TriMesh, VertexId};
use std::collections::HashMap;

/// Neighbourhoods of a mesh, prepared once.
///
/// **Shapes** one list per vertex or face of the mesh.
///
/// **Guarantees** all lists are in ascending order of id, so traversals are deterministic.
#[derive(Clone, Debug)]
pub struct Adjacency {
    vertex_faces_start: Vec<u32>,
    vertex_faces: Vec<FaceId>,
    neighbours_start: Vec<u32>,
    neighbours: Vec<VertexId>,
    edges: Vec<([VertexId; 2], [Option<FaceId>; 2])>,
    face_neighbours: PerFace<[Option<FaceId>; 3]>,
    boundary: Vec<[VertexId; 2]>,
    /// Sides without an opposite one of edges of two and more faces.
    unmatched: Vec<[VertexId; 2]>,
}

impl Adjacency {
    /// Prepares all lists.
    pub fn prepare(mesh: &TriMesh) -> Self {
        let vertex_count = mesh.vertex_count();
        let mut start = vec![0u32; vertex_count + 1];
        for face in mesh.faces().iter() {
            for v in face {
                start[v.index() + 1] += 1;
            }
        }
        for i in 0..vertex_count {
            start[i + 1] += start[i];
        }
        let mut cursor = start.clone();
        let mut vertex_faces = vec![FaceId(0); start[vertex_count] as usize];
        for (f, face) in mesh.faces().enumerate() {
            for v in face {
                vertex_faces[cursor[v.index()] as usize] = f;
                cursor[v.index()] += 1;
            }
        }

        // Half-edges sorted by their ends: those of one edge are adjacent, in the order of faces.
        let half_edge = |h: usize| {
            let face = &mesh.faces().as_slice()[h / 3];
            [face[h % 3], face[(h % 3 + 1) % 3]]
        };
        let half_edge_count = mesh.face_count() * 3;
        // In buckets by the lower end, each in the order of faces; buckets are small.
        let mut bucket_start = vec![0u32; vertex_count + 1];
        let lower_and_upper = |h: usize| {
            let [a, b] = half_edge(h);
            (a.min(b), a.max(b))
        };
        for h in 0..half_edge_count {
            bucket_start[lower_and_upper(h).0.index() + 1] += 1;
        }
        for i in 0..vertex_count {
            bucket_start[i + 1] += bucket_start[i];
        }
        let mut cursor = bucket_start.clone();
        let mut by_lower = vec![(VertexId(0), 0u32); half_edge_count];
        for h in 0..half_edge_count {
            let (lower, upper) = lower_and_upper(h);
            by_lower[cursor[lower.index()] as usize] = (upper, h as u32);
            cursor[lower.index()] += 1;
        }
        // Its first half-edge represents an undirected edge; edges are in the order of faces.
        const NONE: u32 = u32::MAX;
        let mut first_of = vec![0u32; half_edge_count];
        let mut second_of_first = vec![NONE; half_edge_count];
        let mut unmatched = Vec::new();
        for v in 0..vertex_count {
            let bucket = &mut by_lower[bucket_start[v] as usize..bucket_start[v + 1] as usize];
            bucket.sort_unstable();
            for group in bucket.chunk_by(|x, y| x.0 == y.0) {
                let first = group[0].1;
                group.iter().for_each(|&(_, h)| first_of[h as usize] = first);
                if let Some(second) = group.get(1) {
                    second_of_first[first as usize] = second.1;
                    let ends = half_edge(first as usize);
                    if ends[0] == ends[1] {
                        continue;
                    }
                    let along = group.iter().filter(|&&(_, h)| half_edge(h as usize) == ends).count();
                    let against = group.len() - along;
                    let side = if along > against { ends } else { [ends[1], ends[0]] };
                    unmatched.extend(std::iter::repeat_n(side, along.abs_diff(against)));
                }
            }
        }
        let face_at = |h: u32| FaceId(h / 3);
        let second_face = |first: u32| match second_of_first[first as usize] {
            NONE => None,
            second => Some(face_at(second)),
        };
        let mut edges: Vec<([VertexId; 2], [Option<FaceId>; 2])> = Vec::with_capacity(half_edge_count * 2 / 3);
        let mut directed_of_first: Vec<[VertexId; 2]> = Vec::with_capacity(half_edge_count * 2 / 3);
        for first in (0..half_edge_count as u32).filter(|&h| first_of[h as usize] == h) {
            let [a, b] = half_edge(first as usize);
            edges.push(([a.min(b), a.max(b)], [Some(face_at(first)), second_face(first)]));
            directed_of_first.push([a, b]);
        }
        let face_neighbours = mesh
            .face_ids()
            .map(|f| {
                std::array::from_fn(|k| {
                    let first = first_of[f.index() * 3 + k];
                    if face_at(first) == f { second_face(first) } else { Some(face_at(first)) }
                })
            })
            .collect();
        let boundary = edges
            .iter()
            .zip(&directed_of_first)
            .filter(|((ends, faces), _)| faces[1].is_none() && ends[0] != ends[1])
            .map(|(_, &directed)| directed)
            .collect();

        let mut neighbours_start = vec![0u32; vertex_count + 1];
        let joins = |ends: &[VertexId; 2]| ends[0] != ends[1];
        for (ends, _) in edges.iter().filter(|(ends, _)| joins(ends)) {
            ends.iter().for_each(|v| neighbours_start[v.index() + 1] += 1);
        }
        for i in 0..vertex_count {
            neighbours_start[i + 1] += neighbours_start[i];
        }
        let mut cursor = neighbours_start.clone();
        let mut neighbours = vec![VertexId(0); neighbours_start[vertex_count] as usize];
        for ([a, b], _) in edges.iter().filter(|(ends, _)| joins(ends)) {
            for (from, to) in [(a, b), (b, a)] {
                neighbours[cursor[from.index()] as usize] = *to;
                cursor[from.index()] += 1;
            }
        }
        for v in 0..vertex_count {
            neighbours[neighbours_start[v] as usize..neighbours_start[v + 1] as usize].sort_unstable();
        }
        Self {
            vertex_faces_start: start,
            vertex_faces,
            neighbours_start,
            neighbours,
            edges,
            face_neighbours,
            boundary,
            unmatched,
        }
    }

    /// Stops a walk over a mesh with the adjacency of another, which would take the wrong neighbours silently. Each stage
    /// checks an adjacency that it is given.
    pub(super) fn assert_is_of(&self, mesh: &TriMesh) {
        let [own, given] = [[self.vertex_count(), self.face_count()], [mesh.vertex_count(), mesh.face_count()]];
        assert_eq!(own, given, "vertices and faces of the adjacency and of the mesh");
    }

    /// The number of vertices of the mesh.
    pub fn vertex_count(&self) -> usize {
        self.vertex_faces_start.len() - 1
    }

    /// The number of faces of the mesh.
    pub fn face_count(&self) -> usize {
        self.face_neighbours.len()
    }

    /// Faces that meet at `v`.
    ///
    /// **Shapes** one id per incident face.
    pub fn faces_of(&self, v: VertexId) -> &[FaceId] {
        &self.vertex_faces[self.vertex_faces_start[v.index()] as usize..self.vertex_faces_start[v.index() + 1] as usize]
    }

    /// Vertices joined to `v` by an edge.
    ///
    /// **Shapes** one id per edge at `v`.
    pub fn neighbours_of(&self, v: VertexId) -> &[VertexId] {
        &self.neighbours[self.neighbours_start[v.index()] as usize..self.neighbours_start[v.index() + 1] as usize]
    }

    /// Every undirected edge once, lower id first, with its first two faces.
    ///
    /// **Shapes** `E` entries.
    pub fn edges(&self) -> &[([VertexId; 2], [Option<FaceId>; 2])] {
        &self.edges
    }

    /// The face across each side of a face; side `k` runs from corner `k` to corner `k + 1`.
    pub fn face_neighbours(&self, f: FaceId) -> [Option<FaceId>; 3] {
        self.face_neighbours[f]
    }

    /// Edges with one face, in the direction of that face.
    ///
    /// **Shapes** B × 2.
    pub fn boundary_edges(&self) -> &[[VertexId; 2]] {
        &self.boundary
    }

    /// Which vertices are on a boundary.
    ///
    /// **Shapes** one entry per vertex.
    pub fn boundary_vertices(&self) -> PerVertex<bool> {
        let mut on_boundary = PerVertex::filled(false, self.neighbours_start.len() - 1);
        for &[a, b] in &self.boundary {
            on_boundary[a] = true;
            on_boundary[b] = true;
        }
        on_boundary
    }

    /// Boundary loops, each a closed ring of vertices in the direction of the faces at it, longest count first
    /// (ties by lowest id). Loops that touch in a vertex are separate.
    ///
    /// **Guarantees** they are closed whatever the mesh: where three faces share an edge, one of its sides belongs to a loop.
    ///
    /// **Shapes** one list of vertices per loop, without repetition of the first.
    pub fn boundary_loops(&self) -> Vec<Vec<VertexId>> {
        let mut next: HashMap<VertexId, Vec<VertexId>> = HashMap::new();
        let sides = || self.boundary.iter().chain(&self.unmatched);
        for &[a, b] in sides() {
            next.entry(a).or_default().push(b);
        }
        let mut starts: Vec<VertexId> = sides().map(|e| e[0]).collect();
        starts.sort_unstable();
        let mut loops = Vec::new();
        for start in starts {
            while let Some(first) = next.get_mut(&start).and_then(Vec::pop) {
                let mut ring = vec![start];
                let mut at = first;
                while at != start {
                    ring.push(at);
                    // As many sides lead to a vertex as from it: those of each face do, and opposite ones cancel out.
                    at = next.get_mut(&at).and_then(Vec::pop).expect("a way on from each vertex but the start");
                }
                loops.push(ring);
            }
        }
        loops.sort_by_key(|ring| (std::cmp::Reverse(ring.len()), ring.iter().min().copied()));
        loops
    }

    /// The connected parts of the vertices that are flagged, by their first vertices; each part breadth-first from there.
    ///
    /// **Shapes** `flagged`: one entry per vertex.
    pub fn parts_of(&self, flagged: &PerVertex<bool>) -> Vec<Vec<VertexId>> {
        let mut open = flagged.clone();
        let mut parts = Vec::new();
        for seed in (0..flagged.len()).map(VertexId::from_index) {
            if !std::mem::replace(&mut open[seed], false) {
                continue;
            }
            let (mut part, mut at) = (vec![seed], 0);
            while at < part.len() {
                for &next in self.neighbours_of(part[at]) {
                    if std::mem::replace(&mut open[next], false) {
                        part.push(next);
                    }
                }
                at += 1;
            }
            parts.push(part);
        }
        parts
    }

    /// Connected component of each face (through shared edges), components numbered by descending face count; and their
    /// number.
    ///
    /// **Shapes** one entry per face.
    pub fn face_components(&self) -> (PerFace<u32>, usize) {
        let count = self.face_neighbours.len();
        let mut raw = vec![u32::MAX; count];
        let mut sizes = Vec::new();
        for seed in 0..count {
            if raw[seed] != u32::MAX {
                continue;
            }
            let id = sizes.len() as u32;
            let mut size = 0usize;
            let mut stack = vec![FaceId::from_index(seed)];
            raw[seed] = id;
            while let Some(f) = stack.pop() {
                size += 1;
                for g in self.face_neighbours[f].into_iter().flatten() {
                    if raw[g.index()] == u32::MAX {
                        raw[g.index()] = id;
                        stack.push(g);
                    }
                }
            }
            sizes.push(size);
        }
        let mut order: Vec<u32> = (0..sizes.len() as u32).collect();
        order.sort_by_key(|&c| (std::cmp::Reverse(sizes[c as usize]), c));
        let mut rank = vec![0u32; sizes.len()];
        for (r, &c) in order.iter().enumerate() {
            rank[c as usize] = r as u32;
        }
        (raw.into_iter().map(|c| rank[c as usize]).collect(), sizes.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    #[test]
    fn a_third_face_at_an_edge_knows_the_first_and_a_repeated_corner_harms_nothing() {
        let points = (0..5).map(|i| Point::new(i as f64, (i * i) as f64, 1.0)).collect();
        let mesh = TriMesh::try_from_indices(points, &[[0, 1, 2], [1, 0, 3], [0, 1, 4], [2, 2, 4]]).unwrap();
        let adjacency = Adjacency::prepare(&mesh);
        let at_first_side = |f: u32| adjacency.face_neighbours(FaceId(f))[0];
        assert_eq!([0, 1, 2].map(at_first_side), [Some(FaceId(1)), Some(FaceId(0)), Some(FaceId(0))]);
        assert_eq!(adjacency.edges()[0], ([VertexId(0), VertexId(1)], [Some(FaceId(0)), Some(FaceId(1))]));
        assert_eq!(adjacency.faces_of(VertexId(1)), &[FaceId(0), FaceId(1), FaceId(2)]);
        assert_eq!(adjacency.neighbours_of(VertexId(2)), &[VertexId(0), VertexId(1), VertexId(4)]);
    }

    #[test]
    fn loops_are_closed_and_are_what_is_left_of_the_sides_whatever_the_faces() {
        // Any faces over a few vertices: edges of many faces, faces that face opposite ways, repeated corners.
        let mut seed = 1u64;
        let mut chance = |below: u64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((seed >> 33) % below) as u32
        };
        for _ in 0..200 {
            let count = 1 + chance(30);
            let faces: Vec<[u32; 3]> = (0..count).map(|_| [chance(8), chance(8), chance(8)]).collect();
            let points = (0..8).map(|i| Point::new(f64::from(i), f64::from(i * i), 1.0)).collect();
            let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
            let mut left: HashMap<[VertexId; 2], i64> = HashMap::new();
            let mut add = |a: VertexId, b: VertexId, by: i64| {
                *left.entry([a.min(b), a.max(b)]).or_default() += if a < b { by } else { -by };
            };
            for f in mesh.faces().iter() {
                (0..3).filter(|&k| f[k] != f[(k + 1) % 3]).for_each(|k| add(f[k], f[(k + 1) % 3], 1));
            }
            for ring in Adjacency::prepare(&mesh).boundary_loops() {
                (0..ring.len()).for_each(|k| add(ring[k], ring[(k + 1) % ring.len()], -1));
            }
            assert!(left.values().all(|&count| count == 0), "{faces:?}");
        }
    }

    #[test]
    fn an_open_strip_has_one_loop_of_all_its_vertices() {
        let points = (0..6).map(|i| Point::new((i / 2) as f64, (i % 2) as f64, 0.0)).collect();
        let mesh = TriMesh::try_from_indices(points, &[[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]]).unwrap();
        let adjacency = Adjacency::prepare(&mesh);
        let loops = adjacency.boundary_loops();
        assert_eq!(loops.len(), 1);
        assert_eq!(loops[0].len(), 6);
        assert_eq!(adjacency.face_components().1, 1);
        assert_eq!(adjacency.neighbours_of(VertexId(2)), &[VertexId(0), VertexId(1), VertexId(3), VertexId(4)]);
    }
}
