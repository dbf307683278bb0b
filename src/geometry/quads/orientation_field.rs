//! The orientation field: per vertex a cross in its tangent plane, turned as little as possible from vertex to vertex.
//!
//! **Source** Jakob et al. 2015, §3: extrinsic smoothness; Gauss–Seidel from the coarsest level to the finest.

use super::hierarchy::Level;
use crate::geometry::Vec3;

/// Sweeps per level; Jakob's value.
const SWEEPS: usize = 6;

/// One direction of each vertex's cross, a unit tangent.
pub(super) fn orientation_field(levels: &[Level]) -> Vec<Vec3> {
    let mut field: Vec<Vec3> = Vec::new();
    for (rank, level) in levels.iter().enumerate().rev() {
        let start = |v: usize| match levels.get(rank + 1) {
            None => tangent_of(&Vec3::y(), &level.normals[v]),
            Some(_) => tangent_of(&field[level.coarser[v] as usize], &level.normals[v]),
        };
        let mut finer: Vec<Vec3> = (0..level.points.len()).map(start).collect();
        for (v, bound) in level.bound.iter().enumerate() {
            if let Some((_, along)) = bound {
                finer[v] = tangent_of(along, &level.normals[v]);
            }
        }
        for _ in 0..SWEEPS {
            sweep(level, &mut finer);
        }
        field = finer;
    }
    field
}

fn sweep(level: &Level, field: &mut [Vec3]) {
    for v in 0..field.len() {
        if level.bound[v].is_some() {
            continue;
        }
        let normal = level.normals[v];
        let (mut sum, mut weight) = (field[v], 0.0);
        for &w in level.neighbours.get(v) {
            let [own, other] = matched(&sum, &normal, &field[w as usize], &level.normals[w as usize]);
            sum = tangent_of(&(own * weight + other), &normal);
            weight += 1.0;
        }
        field[v] = sum;
    }
}

/// The directions of two crosses that are nearest to each other.
pub(super) fn matched(a: &Vec3, a_normal: &Vec3, b: &Vec3, b_normal: &Vec3) -> [Vec3; 2] {
    let of_a = [*a, a_normal.cross(a)];
    let of_b = [*b, b_normal.cross(b)];
    let mut best = (-1.0, of_a[0], of_b[0]);
    for x in of_a {
        for y in of_b {
            let dot = x.dot(&y);
            if dot.abs() > best.0 {
                best = (dot.abs(), x, if dot < 0.0 { -y } else { y });
            }
        }
    }
    [best.1, best.2]
}

/// A unit tangent near `v`.
pub(super) fn tangent_of(v: &Vec3, normal: &Vec3) -> Vec3 {
    let flat = |v: &Vec3| (v - normal * normal.dot(v)).try_normalize(1e-6);
    flat(v).or_else(|| flat(&Vec3::z())).or_else(|| flat(&Vec3::x())).unwrap_or_else(Vec3::x)
}
