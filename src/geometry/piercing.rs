//! Which edges of a surface pass through its faces, decided with exact arithmetic.

use super::face_tree::FaceTree;
use super::{Aabb, FaceId, Point, TriMesh, VertexId};
use rayon::prelude::*;
use robust::{Coord3D, orient3d};

/// An edge of one face that passes through another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Piercing {
    /// The face with the edge.
    pub from: FaceId,
    /// The face that the edge passes through.
    pub face: FaceId,
    /// The ends of the edge.
    pub edge: [VertexId; 2],
}

/// All piercings between one of `faces` and any face of the mesh, in ascending order.
///
/// The signs of all volumes are exact, and zero counts as positive, so that a surface that passes through an edge or a
/// vertex is counted and two surfaces that only touch are not counted twice. Edges that share a vertex, or the place of a
/// vertex, with a face do not pierce it.
///
/// **Shapes** `faces` any number of ids of `mesh`, the mesh of `tree`.
pub(super) fn piercings(mesh: &TriMesh, tree: &FaceTree, faces: &[FaceId]) -> Vec<Piercing> {
    let mut asked = vec![false; mesh.face_count()];
    faces.iter().for_each(|f| asked[f.index()] = true);
    let mut found: Vec<Piercing> = faces
        .par_iter()
        .flat_map_iter(|&f| {
            let [p, q, r] = mesh.triangle(f);
            let region = Aabb { min: p.inf(&q).inf(&r), max: p.sup(&q).sup(&r) };
            let mut found = Vec::new();
            for g in tree.overlapping(&region) {
                // Pairs of two faces that are both asked about are found once.
                if g == f || (asked[g.index()] && g < f) {
                    continue;
                }
                pierced_by(mesh, f, g, &mut found);
                pierced_by(mesh, g, f, &mut found);
            }
            found
        })
        .collect();
    found.sort_unstable();
    found
}

/// Adds the edges of `from` that pass through `face`.
fn pierced_by(mesh: &TriMesh, from: FaceId, face: FaceId, found: &mut Vec<Piercing>) {
    let (ends, corners) = (mesh.faces()[from], mesh.faces()[face]);
    let triangle = mesh.triangle(face);
    for k in 0..3 {
        let edge = [ends[k], ends[(k + 1) % 3]];
        if edge.iter().any(|v| corners.contains(v)) {
            continue;
        }
        let [p, q] = edge.map(|v| mesh.points()[v]);
        if pierces(&p, &q, &triangle) {
            found.push(Piercing { from, face, edge });
        }
    }
}

/// Whether the segment passes through the triangle.
fn pierces(p: &Point, q: &Point, [a, b, c]: &[Point; 3]) -> bool {
    let lowest = p.inf(q);
    let highest = p.sup(q);
    let (min, max) = (a.inf(b).inf(c), a.sup(b).sup(c));
    if (0..3).any(|k| lowest[k] > max[k] || highest[k] < min[k]) {
        return false;
    }
    let is_positive = |w: &Point, x: &Point, y: &Point, z: &Point| orient3d(of(w), of(x), of(y), of(z)) >= 0.0;
    if is_positive(a, b, c, p) == is_positive(a, b, c, q) {
        return false;
    }
    let side = is_positive(p, q, a, b);
    if side != is_positive(p, q, b, c) || side != is_positive(p, q, c, a) {
        return false;
    }
    ![p, q].iter().any(|end| [a, b, c].contains(end))
}

fn of(p: &Point) -> Coord3D<f64> {
    Coord3D { x: p.x, y: p.y, z: p.z }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes_for_tests::{noise, sphere};
    use crate::geometry::{SurfaceIndex, Vec3, intersecting_pairs};

    fn both(a: &TriMesh, b: &TriMesh) -> TriMesh {
        let points: Vec<Point> = a.points().iter().chain(b.points().iter()).copied().collect();
        let shifted = b.faces().iter().map(|f| f.map(|v| VertexId::from_index(v.index() + a.vertex_count())));
        let faces: Vec<[VertexId; 3]> = a.faces().iter().copied().chain(shifted).collect();
        TriMesh::try_new(points, faces).unwrap()
    }

    fn pairs(mesh: &TriMesh) -> Vec<(FaceId, FaceId)> {
        let all: Vec<FaceId> = mesh.face_ids().collect();
        let found = SurfaceIndex::prepare(mesh).piercings(&all);
        let mut pairs: Vec<_> = found.iter().map(|x| (x.from.min(x.face), x.from.max(x.face))).collect();
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }

    #[test]
    fn two_spheres_cross_in_the_pairs_that_the_interval_test_finds() {
        let (a, b) = (sphere(10, 14), sphere(11, 13).map_points(|p| p + Vec3::new(0.7, 0.1, -0.2)));
        let offset = a.face_count();
        let expected: Vec<_> =
            intersecting_pairs(&a, &b).into_iter().map(|(f, g)| (f, FaceId::from_index(g.index() + offset))).collect();
        assert!(expected.len() > 20);
        assert_eq!(pairs(&both(&a, &b)), expected);
    }

    #[test]
    fn a_fold_is_found_although_its_faces_share_a_vertex() {
        // Two triangles share a corner; the far edge of the second passes through the first.
        let p = |x, y, z| Point::new(x, y, z);
        let points = vec![p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.0), p(0.0, 1.0, 0.0), p(0.3, 0.2, -0.5), p(0.3, 0.3, 0.5)];
        let mesh = TriMesh::try_from_indices(points, &[[0, 1, 2], [0, 3, 4]]).unwrap();
        assert_eq!(pairs(&mesh).len(), 1);
    }

    #[test]
    fn moved_faces_alone_give_their_pairs_once() {
        let mut next = noise(3);
        let mesh = sphere(12, 16);
        let shaken = mesh.with_points(
            mesh.points().iter().map(|p| p + Vec3::new(next(), next(), next()) * 0.15).collect::<Vec<_>>(),
        );
        let all: Vec<FaceId> = shaken.face_ids().collect();
        let index = SurfaceIndex::prepare(&shaken);
        let every = index.piercings(&all);
        assert!(every.len() > 20, "{}", every.len());
        let some: Vec<FaceId> = all.iter().copied().filter(|f| f.index() % 3 == 0).collect();
        let touching: Vec<_> =
            every.iter().copied().filter(|x| [x.from, x.face].iter().any(|f| f.index() % 3 == 0)).collect();
        assert_eq!(index.piercings(&some), touching);
    }

    #[test]
    fn contact_at_a_coincident_vertex_is_no_piercing() {
        let p = |x, y, z| Point::new(x, y, z);
        let points = vec![
            p(0.0, 0.0, 0.0),
            p(1.0, 0.0, 0.0),
            p(0.0, 1.0, 0.0),
            p(0.0, 0.0, 0.0),
            p(0.2, 0.1, 1.0),
            p(0.1, 0.2, -1.0),
        ];
        let mesh = TriMesh::try_from_indices(points, &[[0, 1, 2], [3, 4, 5]]).unwrap();
        // The edge 4–5 passes through the face; the edges at the coincident vertex do not count.
        assert_eq!(pairs(&mesh), vec![(FaceId(0), FaceId(1))]);
        let lifted = mesh.with_points(
            mesh.points().iter().map(|q| if q.z < 0.0 { p(q.x, q.y, 0.5) } else { *q }).collect::<Vec<_>>(),
        );
        assert!(pairs(&lifted).is_empty());
    }
}
