//! Closest point, signed distance and ray casting on a mesh.

use super::face_tree::FaceTree;
use super::triangle::closest_on_triangle;
use super::{Aabb, Adjacency, FaceId, PerFace, PerVertex, Piercing, Point, TriMesh, Vec3, VertexId};
use std::sync::OnceLock;

/// A bounding volume hierarchy of the faces, prepared once, queried often and from many threads.
///
/// **Guarantees** closest points and distances are computed in `f64`; equal queries give equal results; faces without
/// area are allowed.
#[derive(Clone)]
pub struct SurfaceIndex {
    mesh: TriMesh,
    tree: FaceTree,
    pseudonormals: OnceLock<Pseudonormals>,
}

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The face on which it lies.
    pub face: FaceId,
    /// Weights of the face's corners; exactly zero for those that do not matter on an edge or corner.
    pub barycentric: [f64; 3],
    /// Its position.
    pub point: Point,
    /// Its distance from the query point, in metres.
    pub distance: f64,
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// The face, hit from either side.
    pub face: FaceId,
    /// Distance from the origin of the ray, in metres.
    pub distance: f64,
    /// Weights of the face's corners.
    pub barycentric: [f64; 3],
}

/// Normals of all features of a mesh, such that their sign tells inside from outside.
#[derive(Clone)]
struct Pseudonormals {
    of_faces: PerFace<Vec3>,
    /// Side `k` runs from corner `k` to corner `k + 1`.
    of_sides: PerFace<[Vec3; 3]>,
    of_vertices: PerVertex<Vec3>,
}

impl SurfaceIndex {
    /// Builds the hierarchy.
    pub fn prepare(mesh: &TriMesh) -> Self {
        Self { mesh: mesh.clone(), tree: FaceTree::prepare(mesh), pseudonormals: OnceLock::new() }
    }

    /// Moves the vertices. Several times faster than preparing again; queries stay fast as long as neighbours stay close.
    ///
    /// **Requires** the same faces.
    ///
    /// # Panics
    /// If the number of faces differs.
    pub fn follow(&mut self, mesh: &TriMesh) {
        assert_eq!(mesh.face_count(), self.mesh.face_count(), "a surface follows a mesh with the same faces");
        self.mesh = mesh.clone();
        self.tree.follow(mesh);
        self.pseudonormals = OnceLock::new();
    }

    /// The mesh that was prepared.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// The closest point of the surface; of two whose distances agree to one part in 10⁷, either. A mesh without faces
    /// (or a query that is not a number) has none: the result then has an infinite `distance` and face 0, which must
    /// not be used.
    pub fn closest(&self, p: &Point) -> SurfacePoint {
        self.closest_within(p, f64::INFINITY).unwrap_or(SurfacePoint {
            face: FaceId(0),
            barycentric: [1.0, 0.0, 0.0],
            point: *p,
            distance: f64::INFINITY,
        })
    }

    /// The closest point, if it is no farther than `max_distance`. Much faster than [`closest`](Self::closest) where
    /// the surface is farther than that.
    pub fn closest_within(&self, p: &Point, max_distance: f64) -> Option<SurfacePoint> {
        self.closest_within_from(p, max_distance, None)
    }

    /// The closest point within `max_distance`, found faster with a good guess: the result of a similar query.
    pub fn closest_within_from(&self, p: &Point, max_distance: f64, guess: Option<FaceId>) -> Option<SurfacePoint> {
        let (face, barycentric, point) = self.tree.closest(p, max_distance, guess)?;
        Some(SurfacePoint { face, barycentric, point, distance: (p - point).norm() })
    }

    /// The closest point and on which side of the surface `p` lies: `+1.0` outside, `-1.0` inside.
    ///
    /// Correct if the surface near the closest point is consistently oriented; at holes the surface continues in its own
    /// plane. Points on the surface, and points without normals, are outside.
    ///
    /// **Source** Bærentzen & Aanæs 2005, signed distance by angle-weighted pseudonormals.
    pub fn closest_signed(&self, p: &Point) -> (SurfacePoint, f64) {
        let found = self.closest(p);
        let inside = found.distance.is_finite() && (p - found.point).dot(&self.pseudonormal(&found)) < 0.0;
        (found, if inside { -1.0 } else { 1.0 })
    }

    /// Distance to the surface, negative inside.
    pub fn signed_distance(&self, p: &Point) -> f64 {
        let (found, side) = self.closest_signed(p);
        side * found.distance
    }

    /// Unit normal of the face, edge or corner on which `at` lies; zero where no face with area meets it.
    pub fn pseudonormal(&self, at: &SurfacePoint) -> Vec3 {
        if at.face.index() >= self.mesh.face_count() {
            return Vec3::zeros();
        }
        let normals = self.pseudonormals.get_or_init(|| Pseudonormals::of(&self.mesh));
        let corners = self.mesh.faces()[at.face];
        match at.barycentric.map(|w| w > 0.0) {
            [true, false, false] => normals.of_vertices[corners[0]],
            [false, true, false] => normals.of_vertices[corners[1]],
            [false, false, true] => normals.of_vertices[corners[2]],
            [true, true, false] => normals.of_sides[at.face][0],
            [false, true, true] => normals.of_sides[at.face][1],
            [true, false, true] => normals.of_sides[at.face][2],
            _ => normals.of_faces[at.face],
        }
    }

    /// The first face that a ray meets within `max` metres, from either side. A direction of length zero hits nothing.
    pub fn cast_ray(&self, origin: &Point, direction: &Vec3, max: f64) -> Option<RayHit> {
        let unit = direction.try_normalize(1e-300)?;
        let (face, distance, barycentric) = self.tree.cast_ray(origin, &unit, max)?;
        Some(RayHit { face, distance, barycentric })
    }

    /// All pairs (one of `faces` of `other`, face of this mesh) that cross, in ascending order, as
    /// [`intersecting_pairs`](super::intersecting_pairs) without building the hierarchy again.
    ///
    /// **Shapes** `faces` any number of ids of `other`; the result has one entry per pair.
    pub fn crossing_pairs(&self, other: &TriMesh, faces: &[FaceId]) -> Vec<(FaceId, FaceId)> {
        super::intersection::pairs_of_faces(other, faces, &self.tree, |_, _| true)
    }

    /// All edges of this mesh that pass through its faces where one of the two faces is in `faces`, in ascending order.
    /// Exact.
    ///
    /// **Shapes** `faces` any number of ids; the result has one entry per edge of a face and pierced face.
    pub fn piercings(&self, faces: &[FaceId]) -> Vec<Piercing> {
        super::piercing::piercings(&self.mesh, &self.tree, faces)
    }

    /// All faces no farther than `radius`, in ascending order.
    ///
    /// **Shapes** one id per face found.
    pub fn faces_within(&self, p: &Point, radius: f64) -> Vec<FaceId> {
        let reach = Vec3::repeat(radius);
        let region = Aabb { min: p - reach, max: p + reach };
        let mut faces: Vec<FaceId> = self
            .tree
            .overlapping(&region)
            .filter(|&f| {
                let (_, point) = closest_on_triangle(p, self.tree.triangle(f));
                (p - point).norm() <= radius
            })
            .collect();
        faces.sort_unstable();
        faces
    }
}

impl Pseudonormals {
    fn of(mesh: &TriMesh) -> Self {
        let adjacency = Adjacency::prepare(mesh);
        let of_faces: PerFace<Vec3> = mesh.face_ids().map(|f| mesh.face_normal(f)).collect();
        let of_sides = mesh
            .face_ids()
            .map(|f| {
                adjacency.face_neighbours(f).map(|across| {
                    let across = across.map_or_else(Vec3::zeros, |g| of_faces[g]);
                    (of_faces[f] + across).try_normalize(1e-12).unwrap_or_else(|| of_faces[f])
                })
            })
            .collect();
        Self { of_faces, of_sides, of_vertices: mesh.vertex_normals() }
    }
}

impl SurfacePoint {
    /// The corner with the greatest weight.
    pub fn nearest_corner(&self, mesh: &TriMesh) -> VertexId {
        let corners = mesh.faces()[self.face];
        let mut best = 0;
        for k in 1..3 {
            if self.barycentric[k] > self.barycentric[best] {
                best = k;
            }
        }
        corners[best]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::shapes_for_tests::{cube, noise, sphere};
    use crate::geometry::triangle::ray_meets_triangle;

    fn queries(count: usize, reach: f64) -> Vec<Point> {
        let mut next = noise(7);
        (0..count).map(|_| Point::new(next() * reach, next() * reach, next() * reach)).collect()
    }

    #[test]
    fn closest_equals_the_naive_search_far_and_near() {
        for offset in [0.0, 50.0] {
            let mesh = sphere(12, 16).map_points(|p| p + Vec3::new(offset, -offset, 0.3));
            let index = SurfaceIndex::prepare(&mesh);
            for reach in [0.9, 1.1, 30.0] {
                for q in queries(200, reach) {
                    let q = q + Vec3::new(offset, -offset, 0.3);
                    let naive = mesh
                        .face_ids()
                        .map(|f| (q - closest_on_triangle(&q, &mesh.triangle(f)).1).norm())
                        .fold(f64::INFINITY, f64::min);
                    let found = index.closest(&q);
                    assert!(found.distance <= naive * (1.0 + 1e-6) + 1e-9, "{} against {naive}", found.distance);
                    let guessed = index.closest_within_from(&q, 90.0, Some(FaceId(17))).unwrap().distance;
                    assert!((guessed - found.distance).abs() <= 1e-6 * naive + 1e-9);
                    assert!(index.closest_within(&q, found.distance * 0.999).is_none());
                    assert!(index.closest_within(&q, found.distance * 1.001).is_some());
                }
            }
        }
    }

    #[test]
    fn what_followed_a_move_answers_as_if_prepared_anew() {
        let mesh = sphere(12, 16);
        let bent = mesh.map_points(|p| Point::new(p.x * 2.0 + 7.0, p.y + p.x * p.x, p.z - 0.5 * p.x));
        let mut index = SurfaceIndex::prepare(&mesh);
        index.follow(&bent);
        let anew = SurfaceIndex::prepare(&bent);
        for q in queries(300, 3.0) {
            let q = q + Vec3::new(7.0, 0.0, 0.0);
            assert!((index.closest(&q).distance - anew.closest(&q).distance).abs() < 1e-6);
            assert!((index.signed_distance(&q) - anew.signed_distance(&q)).abs() < 1e-6);
            let [a, b] = [&index, &anew].map(|i| i.cast_ray(&q, &Vec3::x(), 9.0).map(|hit| hit.distance));
            assert_eq!(a, b);
        }
    }

    #[test]
    fn a_point_of_the_surface_is_at_distance_zero() {
        let mesh = sphere(8, 12);
        let index = SurfaceIndex::prepare(&mesh);
        for p in mesh.points().iter() {
            assert_eq!(index.closest(p).distance, 0.0);
            assert_eq!(index.closest_within(p, 0.0).map(|s| s.distance), Some(0.0));
        }
    }

    #[test]
    fn signs_of_a_cube_are_right_at_faces_edges_and_corners() {
        let index = SurfaceIndex::prepare(&cube());
        for q in queries(3000, 2.0) {
            let inside = q.iter().all(|c| (0.0..=1.0).contains(c));
            assert_eq!(index.closest_signed(&q).1 < 0.0, inside, "{q}");
        }
    }

    #[test]
    fn rays_meet_the_nearest_face_from_either_side() {
        let mesh = sphere(20, 30);
        let index = SurfaceIndex::prepare(&mesh);
        let mut next = noise(3);
        for q in queries(300, 2.0) {
            let direction = Vec3::new(next(), next(), next());
            let naive = mesh
                .face_ids()
                .filter_map(|f| ray_meets_triangle(&q, &direction.normalize(), &mesh.triangle(f)))
                .map(|hit| hit.0)
                .fold(f64::INFINITY, f64::min);
            match index.cast_ray(&q, &direction, 100.0) {
                Some(hit) => assert!((hit.distance - naive).abs() < 1e-6),
                None => assert!(naive.is_infinite()),
            }
            if q.coords.norm() < 0.9 {
                assert!(index.cast_ray(&q, &direction, 100.0).is_some(), "a closed surface has no gap");
            }
        }
        let along_an_axis = index.cast_ray(&Point::new(0.0, 0.0, -5.0), &Vec3::z(), 4.5).unwrap();
        assert!((along_an_axis.distance - 4.0).abs() < 0.02);
        assert!(index.cast_ray(&Point::new(0.0, 0.0, -5.0), &Vec3::z(), 3.5).is_none());
    }

    #[test]
    fn nothing_breaks_without_faces_or_without_area() {
        let empty = TriMesh::try_from_indices(vec![Point::origin()], &[]).unwrap();
        assert!(SurfaceIndex::prepare(&empty).closest(&Point::origin()).distance.is_infinite());
        let stacked = TriMesh::try_from_indices(vec![Point::new(1.0, 0.0, 0.0); 3], &[[0, 1, 2]; 5000]).unwrap();
        let index = SurfaceIndex::prepare(&stacked);
        assert!((index.closest(&Point::origin()).distance - 1.0).abs() < 1e-12);
        assert_eq!(index.closest_signed(&Point::origin()).1, 1.0);
        assert!(index.cast_ray(&Point::origin(), &Vec3::x(), 9.0).is_none());
    }

    #[test]
    fn faces_within_are_those_that_are() {
        let mesh = sphere(12, 16);
        let index = SurfaceIndex::prepare(&mesh);
        for q in queries(20, 1.2) {
            let naive: Vec<FaceId> =
                mesh.face_ids().filter(|&f| (q - closest_on_triangle(&q, &mesh.triangle(f)).1).norm() <= 0.4).collect();
            assert_eq!(index.faces_within(&q, 0.4), naive);
        }
    }
}
