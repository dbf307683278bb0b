//! Which triangles of two meshes cross.

use super::face_tree::FaceTree;
use super::{Aabb, FaceId, Point, TriMesh, Vec3};
use rayon::prelude::*;

/// Greatest distance to a plane that is contact, not crossing, as a share of the longest edge: some hundred roundings of
/// `f64` at a metre, for edges of a centimetre.
const CONTACT_PER_EDGE: f64 = 1e-10;

/// All pairs (face of `a`, face of `b`) that cross, in ascending order.
///
/// Triangles that only touch, in a point or along an edge, do not count; triangles that lie in one plane count where
/// they share area. Faces without area cross nothing.
///
/// **Shapes** one entry per pair.
pub fn intersecting_pairs(a: &TriMesh, b: &TriMesh) -> Vec<(FaceId, FaceId)> {
    let tree = FaceTree::prepare(b);
    pairs_with(a, &tree, |_, _| true)
}

/// All pairs of faces of one mesh that cross, lower id first, in ascending order. Neighbours, which share a vertex, are
/// left out.
///
/// **Shapes** one entry per pair.
pub fn self_intersecting_pairs(mesh: &TriMesh) -> Vec<(FaceId, FaceId)> {
    let tree = FaceTree::prepare(mesh);
    let apart = |f: FaceId, g: FaceId| !mesh.faces()[f].iter().any(|v| mesh.faces()[g].contains(v));
    pairs_with(mesh, &tree, |f, g| f < g && apart(f, g))
}

fn pairs_with(a: &TriMesh, tree: &FaceTree, wanted: impl Fn(FaceId, FaceId) -> bool + Sync) -> Vec<(FaceId, FaceId)> {
    let faces: Vec<FaceId> = a.face_ids().collect();
    pairs_of_faces(a, &faces, tree, wanted)
}

/// The pairs with one of `faces` of `a`.
pub(super) fn pairs_of_faces(
    a: &TriMesh,
    faces: &[FaceId],
    tree: &FaceTree,
    wanted: impl Fn(FaceId, FaceId) -> bool + Sync,
) -> Vec<(FaceId, FaceId)> {
    let mut pairs: Vec<(FaceId, FaceId)> = faces
        .par_iter()
        .flat_map_iter(|&f| {
            let wanted = &wanted;
            let corners = a.triangle(f);
            let [p, q, r] = &corners;
            let region = Aabb { min: p.inf(q).inf(r), max: p.sup(q).sup(r) };
            let met: Vec<FaceId> = tree
                .overlapping(&region)
                .filter(|&g| wanted(f, g) && triangles_cross(&corners, tree.triangle(g)))
                .collect();
            met.into_iter().map(move |g| (f, g))
        })
        .collect();
    pairs.sort_unstable();
    pairs
}

/// Whether two triangles cross, or overlap in one plane.
///
/// **Shapes** `t` and `u` 3 × 3: three corners each.
///
/// **Source** Möller 1997, with strict intervals: contact is no crossing.
pub fn triangles_cross(t: &[Point; 3], u: &[Point; 3]) -> bool {
    let (Some(n_t), Some(n_u)) = (normal(t), normal(u)) else { return false };
    let contact = CONTACT_PER_EDGE * longest_edge(t).max(longest_edge(u));
    let clamped = |d: f64| if d.abs() <= contact { 0.0 } else { d };
    let t_to_u = t.map(|p| clamped(n_u.dot(&(p - u[0]))));
    let u_to_t = u.map(|p| clamped(n_t.dot(&(p - t[0]))));
    if t_to_u == [0.0; 3] || u_to_t == [0.0; 3] {
        return overlap_in_plane(t, u, &n_t, contact);
    }
    let spans = |d: &[f64; 3]| d.iter().any(|&x| x > 0.0) && d.iter().any(|&x| x < 0.0);
    if !spans(&t_to_u) || !spans(&u_to_t) {
        return false;
    }
    let Some(line) = n_t.cross(&n_u).try_normalize(1e-300) else { return false };
    let (t_low, t_high) = interval(t, &t_to_u, &line, &t[0]);
    let (u_low, u_high) = interval(u, &u_to_t, &line, &t[0]);
    t_low.max(u_low) + contact < t_high.min(u_high)
}

/// The interval in which a triangle crossing a plane meets it, along `line` from `origin`.
fn interval(t: &[Point; 3], to_plane: &[f64; 3], line: &Vec3, origin: &Point) -> (f64, f64) {
    let along = t.map(|p| line.dot(&(p - origin)));
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut widen = |x: f64| {
        low = low.min(x);
        high = high.max(x);
    };
    for i in 0..3 {
        let j = (i + 1) % 3;
        if to_plane[i] == 0.0 {
            widen(along[i]);
        }
        if to_plane[i] * to_plane[j] < 0.0 {
            widen(along[i] + (along[j] - along[i]) * (to_plane[i] / (to_plane[i] - to_plane[j])));
        }
    }
    (low, high)
}

/// Whether two triangles of one plane share area: no edge of either separates them.
fn overlap_in_plane(t: &[Point; 3], u: &[Point; 3], n: &Vec3, contact: f64) -> bool {
    let parts = |a: &[Point; 3], b: &[Point; 3]| {
        (0..3).any(|k| {
            let edge = a[(k + 1) % 3] - a[k];
            let Some(outward) = edge.cross(n).try_normalize(1e-300) else { return false };
            let reach = |s: &[Point; 3]| {
                let x = s.map(|p| outward.dot(&(p - a[k])));
                (x[0].min(x[1]).min(x[2]), x[0].max(x[1]).max(x[2]))
            };
            let ((a_low, a_high), (b_low, b_high)) = (reach(a), reach(b));
            a_high.min(b_high) <= a_low.max(b_low) + contact
        })
    };
    !parts(t, u) && !parts(u, t)
}

fn normal([a, b, c]: &[Point; 3]) -> Option<Vec3> {
    (b - a).cross(&(c - a)).try_normalize(1e-30)
}

fn longest_edge([a, b, c]: &[Point; 3]) -> f64 {
    (b - a).norm().max((c - b).norm()).max((a - c).norm())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes_for_tests::{cube, noise, sphere};
    use crate::geometry::triangle::ray_meets_triangle;

    /// A segment of either crosses the other: no intervals in it.
    fn naive(t: &[Point; 3], u: &[Point; 3]) -> bool {
        let pierces = |a: &[Point; 3], b: &[Point; 3]| {
            (0..3).any(|k| {
                let direction = a[(k + 1) % 3] - a[k];
                ray_meets_triangle(&a[k], &direction, b).is_some_and(|(distance, _)| distance <= 1.0)
            })
        };
        pierces(t, u) || pierces(u, t)
    }

    #[test]
    fn random_triangles_cross_just_when_an_edge_pierces_the_other() {
        let mut next = noise(11);
        let mut crossing = 0;
        for _ in 0..20_000 {
            let mut triangle = || [(); 3].map(|()| Point::new(next(), next(), next()));
            let (t, u) = (triangle(), triangle());
            let expected = naive(&t, &u);
            crossing += usize::from(expected);
            assert_eq!(triangles_cross(&t, &u), expected, "{t:?} {u:?}");
            assert_eq!(triangles_cross(&u, &t), expected);
        }
        assert!((2000..15_000).contains(&crossing));
    }

    #[test]
    fn contact_is_no_crossing_and_overlap_is() {
        let p = |x, y, z| Point::new(x, y, z);
        let flat = [p(0.0, 0.0, 0.0), p(1.0, 0.0, 0.0), p(0.0, 1.0, 0.0)];
        assert!(triangles_cross(&flat, &flat), "the same place");
        assert!(triangles_cross(&flat, &flat.map(|q| q + Vec3::new(0.2, 0.2, 0.0))), "overlap in one plane");
        assert!(!triangles_cross(&flat, &[p(1.0, 0.0, 0.0), p(1.0, 1.0, 0.0), p(0.0, 1.0, 0.0)]), "shared edge");
        assert!(
            !triangles_cross(&flat, &[p(0.2, 0.2, 0.0), p(0.2, 0.2, 1.0), p(0.3, 0.2, 1.0)]),
            "a corner rests on it"
        );
        assert!(
            !triangles_cross(&flat, &[p(0.2, 0.2, 0.0), p(0.4, 0.2, 0.0), p(0.3, 0.2, 1.0)]),
            "an edge rests on it"
        );
        assert!(triangles_cross(&flat, &[p(0.2, 0.2, -1.0), p(0.4, 0.2, -1.0), p(0.3, 0.2, 1.0)]), "pierced");
        assert!(triangles_cross(&flat, &[p(0.3, 0.3, 0.0), p(0.2, 0.2, -1.0), p(0.3, 0.2, 1.0)]), "through a corner");
        assert!(!triangles_cross(&flat, &flat.map(|q| q + Vec3::new(0.0, 0.0, 1e-6))), "a micrometre above");
        assert!(!triangles_cross(&flat, &[p(0.2, 0.2, -1.0); 3]), "no area");
    }

    #[test]
    fn pairs_of_meshes_are_those_of_all_pairs() {
        let (a, b) = (sphere(10, 14), sphere(11, 13).map_points(|p| p + Vec3::new(0.7, 0.1, -0.2)));
        let mut all = Vec::new();
        for f in a.face_ids() {
            for g in b.face_ids() {
                if triangles_cross(&a.triangle(f), &b.triangle(g)) {
                    all.push((f, g));
                }
            }
        }
        assert!(all.len() > 20);
        assert_eq!(intersecting_pairs(&a, &b), all);
        assert!(intersecting_pairs(&a, &b.map_points(|p| p + Vec3::x() * 3.0)).is_empty());
        assert!(intersecting_pairs(&a, &a.map_points(|p| p * 0.5)).is_empty(), "one inside the other");
    }

    #[test]
    fn a_sound_mesh_does_not_cross_itself_and_a_dented_one_does() {
        assert!(self_intersecting_pairs(&cube()).is_empty());
        let mesh = sphere(10, 14);
        assert!(self_intersecting_pairs(&mesh).is_empty());
        let mut points = mesh.points().clone();
        let top = points[crate::geometry::VertexId(0)];
        points[crate::geometry::VertexId(0)] = top - Vec3::y() * 2.5;
        let found = self_intersecting_pairs(&mesh.with_points(points));
        assert!(!found.is_empty() && found.iter().all(|(f, g)| f < g));
    }
}
