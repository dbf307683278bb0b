//! Intersecting triangle pairs of two surfaces. This is the plain definition, pair by pair: the metric must not use the
//! intersection test of the stage that it evaluates.

use crate::geometry::{FaceId, Point, SurfaceIndex, TriMesh, VertexId};
use rayon::prelude::*;

/// The number of pairs, one triangle of each mesh, that intersect: an edge of one passes through the other. Triangles
/// that only touch, or are in one plane, do not count.
pub(super) fn crossing_pairs(a: &TriMesh, b: &TriMesh) -> usize {
    let index = SurfaceIndex::prepare(b);
    let faces: Vec<FaceId> = a.face_ids().collect();
    faces
        .par_iter()
        .map(|&f| {
            let triangle = a.triangle(f);
            let centre = Point::from((triangle[0].coords + triangle[1].coords + triangle[2].coords) / 3.0);
            let reach = triangle.iter().map(|p| (p - centre).norm()).fold(0.0, f64::max);
            index.faces_within(&centre, reach).into_iter().filter(|&g| cross(&triangle, &b.triangle(g))).count()
        })
        .sum()
}

/// The number of pairs of triangles of one mesh that intersect: an edge of one passes through the other, with which it
/// shares no vertex.
pub(super) fn self_crossing_pairs(mesh: &TriMesh) -> usize {
    let index = SurfaceIndex::prepare(mesh);
    let faces: Vec<FaceId> = mesh.face_ids().collect();
    let edges_pierce = |f: FaceId, g: FaceId| {
        let (ends, corners) = (mesh.faces()[f], mesh.faces()[g]);
        let is_apart = |v: VertexId| !corners.contains(&v);
        (0..3).map(|k| [ends[k], ends[(k + 1) % 3]]).any(|[p, q]| {
            let (from, to) = (&mesh.points()[p], &mesh.points()[q]);
            is_apart(p) && is_apart(q) && pierces(from, to, &mesh.triangle(g))
        })
    };
    faces
        .par_iter()
        .map(|&f| {
            let triangle = mesh.triangle(f);
            let centre = Point::from((triangle[0].coords + triangle[1].coords + triangle[2].coords) / 3.0);
            let reach = triangle.iter().map(|p| (p - centre).norm()).fold(0.0, f64::max);
            let near = index.faces_within(&centre, reach).into_iter().filter(|&g| g > f);
            near.filter(|&g| edges_pierce(f, g) || edges_pierce(g, f)).count()
        })
        .sum()
}

fn cross(s: &[Point; 3], t: &[Point; 3]) -> bool {
    (0..3).any(|k| pierces(&s[k], &s[(k + 1) % 3], t) || pierces(&t[k], &t[(k + 1) % 3], s))
}

/// Whether the open segment passes through the inside of the triangle.
fn pierces(from: &Point, to: &Point, [a, b, c]: &[Point; 3]) -> bool {
    let volume = |p: &Point, q: &Point, r: &Point, s: &Point| (q - p).dot(&(r - p).cross(&(s - p)));
    let (above, below) = (volume(from, a, b, c), volume(to, a, b, c));
    if above * below >= 0.0 {
        return false;
    }
    let sides = [volume(from, to, a, b), volume(from, to, b, c), volume(from, to, c, a)];
    sides.iter().all(|&v| v > 0.0) || sides.iter().all(|&v| v < 0.0)
}
