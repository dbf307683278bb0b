//! A bounding volume hierarchy over the faces of a mesh: the only file that uses parry.
//!
//! parry computes in `f32`. The tree only prunes here: boxes and queries are widened by the rounding, and every
//! remaining triangle is tested in `f64`.

use super::triangle::{closest_on_triangle, ray_meets_triangle};
use super::{Aabb, FaceId, Point, TriMesh, Vec3};
use parry3d::math::Vector;
use parry3d::partitioning::{Bvh, BvhBuildStrategy, BvhNode};

/// Two roundings to `f32`, relative: the coordinate of a box and that of the query.
const ROUNDING: f64 = 2.5e-7;

/// Boxes around all faces.
#[derive(Clone)]
pub(super) struct FaceTree {
    bvh: Bvh,
    /// Coordinates are taken from here before they are rounded.
    center: Point,
    triangles: Vec<[Point; 3]>,
}

impl FaceTree {
    pub(super) fn prepare(mesh: &TriMesh) -> Self {
        let center = mesh.bounds().map_or_else(Point::origin, |b| b.center());
        let triangles: Vec<_> = mesh.face_ids().map(|f| mesh.triangle(f)).collect();
        let boxes: Vec<_> = boxes(&triangles, &center).collect();
        Self { bvh: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes), center, triangles }
    }

    /// Moves the faces: keeps the hierarchy and recomputes its boxes.
    pub(super) fn follow(&mut self, mesh: &TriMesh) {
        self.triangles = mesh.face_ids().map(|f| mesh.triangle(f)).collect();
        for (face, aabb) in boxes(&self.triangles, &self.center).enumerate() {
            self.bvh.update_partially_if_present(aabb, face as u32, 0.0);
        }
        self.bvh.refit_without_opt();
    }

    pub(super) fn triangle(&self, face: FaceId) -> &[Point; 3] {
        &self.triangles[face.index()]
    }

    /// Closest face no farther than `max_distance`, with barycentrics and point. A good `guess` saves most of
    /// the search.
    pub(super) fn closest(
        &self,
        p: &Point,
        max_distance: f64,
        guess: Option<FaceId>,
    ) -> Option<(FaceId, [f64; 3], Point)> {
        let guessed = guess.and_then(|face| {
            let (barycentric, point) = closest_on_triangle(p, self.triangles.get(face.index())?);
            let distance = (p - point).norm();
            (distance <= max_distance).then_some((distance, (face, barycentric, point)))
        });
        let max_distance = guessed.map_or(max_distance, |found| found.0);
        self.closest_in_boxes(p, max_distance).or(guessed.map(|found| found.1))
    }

    fn closest_in_boxes(&self, p: &Point, max_distance: f64) -> Option<(FaceId, [f64; 3], Point)> {
        let offset = p - self.center;
        let (query, slack) = (to_f32(&offset), (offset.amax() * ROUNDING) as f32);
        let limit = (max_distance * max_distance * (1.0 + ROUNDING)) as f32;
        // The search takes only what is strictly below the limit, so a limit of zero would find nothing.
        let limit = if limit.is_finite() { limit.max(f32::MIN_POSITIVE) } else { f32::MAX };
        let box_distance_squared = |node: &BvhNode, _| {
            let apart = (node.mins() - query).max(query - node.maxs()) - Vector::splat(slack);
            apart.max(Vector::ZERO).length_squared() * (1.0 - ROUNDING as f32)
        };
        let (face, (_, (barycentric, point))) = self.bvh.find_best(limit, box_distance_squared, |face, _| {
            let (barycentric, point) = closest_on_triangle(p, &self.triangles[face as usize]);
            Some(((p - point).norm_squared() as f32, (barycentric, point)))
        })?;
        ((p - point).norm() <= max_distance).then_some((FaceId(face), barycentric, point))
    }

    /// First face along a ray, no farther than `max` lengths of `direction`.
    pub(super) fn cast_ray(&self, origin: &Point, direction: &Vec3, max: f64) -> Option<(FaceId, f64, [f64; 3])> {
        let offset = origin - self.center;
        let (start, slack) = (to_f32(&offset), Vector::splat((offset.amax() * ROUNDING) as f32));
        // A zero component of the direction gets a huge inverse instead of an infinite one: no NaN from 0 × ∞.
        let inverse = to_f32(&direction.map(|d| if d.abs() < 1e-20 { 1e20 } else { 1.0 / d }));
        let limit = if max.is_finite() { (max * (1.0 + ROUNDING)) as f32 } else { f32::MAX };
        let entry = |node: &BvhNode, _| {
            let near = (node.mins() - slack - start) * inverse;
            let far = (node.maxs() + slack - start) * inverse;
            let enter = near.min(far).max_element().max(0.0) * (1.0 - ROUNDING as f32);
            let leave = near.max(far).min_element() * (1.0 + ROUNDING as f32);
            if enter <= leave { enter } else { f32::MAX }
        };
        let (face, (_, (distance, barycentric))) = self.bvh.find_best(limit, entry, |face, _| {
            let (distance, barycentric) = ray_meets_triangle(origin, direction, &self.triangles[face as usize])?;
            Some((distance as f32, (distance, barycentric)))
        })?;
        (distance <= max).then_some((FaceId(face), distance, barycentric))
    }

    /// Faces whose boxes meet `region`, in the order of the tree.
    pub(super) fn overlapping(&self, region: &Aabb) -> impl Iterator<Item = FaceId> {
        let (min, max) = (region.min - self.center, region.max - self.center);
        let slack = min.amax().max(max.amax()) * ROUNDING;
        let (min, max) = (to_f32(&min.add_scalar(-slack)), to_f32(&max.add_scalar(slack)));
        self.bvh.leaves(move |node| node.mins().cmple(max).all() && node.maxs().cmpge(min).all()).map(FaceId)
    }
}

/// Around `center`, wide enough for the rounding.
fn boxes(triangles: &[[Point; 3]], center: &Point) -> impl Iterator<Item = parry3d::bounding_volume::Aabb> {
    let farthest = triangles.iter().flatten().fold(0.0_f64, |most, p| most.max((p - center).amax()));
    let slack = 2.0 * farthest * ROUNDING;
    triangles.iter().map(move |[a, b, c]| {
        let (min, max) = (a.inf(b).inf(c) - center, a.sup(b).sup(c) - center);
        parry3d::bounding_volume::Aabb::new(to_f32(&min.add_scalar(-slack)), to_f32(&max.add_scalar(slack)))
    })
}

fn to_f32(v: &Vec3) -> Vector {
    Vector::new(v.x as f32, v.y as f32, v.z as f32)
}
