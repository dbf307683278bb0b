//! Tubes, balls and trousers with known shape.

use crate::geometry::{Point, TriMesh, Vec3};
use std::f64::consts::TAU;

/// A tube of rings around points of a line, from the first to the last, open at both ends, its faces outward.
pub(super) fn tube(centers: &[Point], radius: f64, around: u32) -> TriMesh {
    let along = (centers[centers.len() - 1] - centers[0]).normalize();
    let across = along.cross(&Vec3::ith(along.iamin(), 1.0)).normalize();
    let other = along.cross(&across);
    let ring = |c: &Point| -> Vec<Point> {
        let angle = |k: u32| TAU * f64::from(k) / f64::from(around);
        (0..around).map(|k| c + (across * angle(k).cos() + other * angle(k).sin()) * radius).collect()
    };
    let points: Vec<Point> = centers.iter().flat_map(ring).collect();
    let mut faces = Vec::new();
    for r in 0..centers.len() as u32 - 1 {
        for k in 0..around {
            let [a, b] = [r * around + k, r * around + (k + 1) % around];
            faces.extend([[a, b, a + around], [b, b + around, a + around]]);
        }
    }
    TriMesh::try_from_indices(points, &faces).unwrap()
}

/// Points on a line.
pub(super) fn line(from: Point, to: Point, count: usize) -> Vec<Point> {
    (0..count).map(|k| from + (to - from) * (k as f64 / (count - 1) as f64)).collect()
}

/// A closed ball, its faces outward.
pub(super) fn ball(center: Point, radius: f64, rings: u32, around: u32) -> TriMesh {
    let mut points = vec![center + Vec3::y() * radius];
    for r in 1..rings {
        let polar = TAU * 0.5 * f64::from(r) / f64::from(rings);
        for k in 0..around {
            let turn = TAU * f64::from(k) / f64::from(around);
            let out = Vec3::new(polar.sin() * turn.cos(), polar.cos(), -polar.sin() * turn.sin());
            points.push(center + out * radius);
        }
    }
    points.push(center - Vec3::y() * radius);
    let last = points.len() as u32 - 1;
    let at = |r: u32, k: u32| 1 + (r - 1) * around + k % around;
    let mut faces = Vec::new();
    for k in 0..around {
        faces.extend([[0, at(1, k), at(1, k + 1)], [last, at(rings - 1, k + 1), at(rings - 1, k)]]);
        for r in 1..rings - 1 {
            faces.extend([[at(r, k), at(r + 1, k), at(r, k + 1)], [at(r, k + 1), at(r + 1, k), at(r + 1, k + 1)]]);
        }
    }
    TriMesh::try_from_indices(points, &faces).unwrap()
}

/// Vertices around a half of the waist, and along the seam of the crotch.
const HALF: u32 = 16;
const SEAM: u32 = 5;

/// Wide trousers, upright and in metres, waist at 1.05, crotch at 0.8, hems at 0.1, symmetric about x = 0.
pub(super) fn trousers() -> TriMesh {
    let waist = |k: u32, y: f64| {
        let angle = TAU * f64::from(k) / f64::from(2 * HALF);
        Point::new(0.19 * angle.sin(), y, 0.15 * angle.cos())
    };
    let (mut points, mut faces) = (Vec::new(), Vec::new());
    let ring = 2 * HALF;
    const RINGS: u32 = 9;
    for r in 0..RINGS {
        points.extend((0..ring).map(|k| waist(k, 1.05 - 0.25 * f64::from(r) / f64::from(RINGS - 1))));
    }
    for r in 0..RINGS - 1 {
        for k in 0..ring {
            let [a, b] = [r * ring + k, r * ring + (k + 1) % ring];
            faces.extend([[a, a + ring, b], [b, a + ring, b + ring]]);
        }
    }
    // The seam goes from the front, angle 0, to the back.
    let crotch = (RINGS - 1) * ring;
    let seam = points.len() as u32;
    points.extend((1..=SEAM).map(|k| Point::new(0.0, 0.8, 0.15 - 0.3 * f64::from(k) / f64::from(SEAM + 1))));
    let left: Vec<u32> = (0..=HALF).map(|k| crotch + k).chain((0..SEAM).rev().map(|k| seam + k)).collect();
    let right: Vec<u32> = (HALF..ring).chain([0]).map(|k| crotch + k).chain((0..SEAM).map(|k| seam + k)).collect();
    for (top, sign) in [(left, 1.0), (right, -1.0)] {
        let around = top.len() as u32;
        let start: Vec<Point> = top.iter().map(|&v| points[v as usize]).collect();
        let mut above = top;
        for r in 1..=24 {
            let share = f64::from(r) / 24.0;
            let round = (4.0 * share).min(1.0);
            let center = Point::new(sign * (0.1 + 0.06 * share), 0.8 - 0.7 * share, 0.0);
            let first = points.len() as u32;
            for p in &start {
                let angle = (p.z).atan2(p.x - sign * 0.095);
                let on_circle = center + Vec3::new(angle.cos(), 0.0, angle.sin()) * 0.095;
                let straight = Point::new(p.x + center.x - sign * 0.1, center.y, p.z);
                points.push(straight + (on_circle - straight) * round);
            }
            let below: Vec<u32> = (first..first + around).collect();
            for k in 0..around as usize {
                let next = (k + 1) % around as usize;
                faces.extend([[above[k], below[k], above[next]], [above[next], below[k], below[next]]]);
            }
            above = below;
        }
    }
    TriMesh::try_from_indices(points, &faces).unwrap()
}
