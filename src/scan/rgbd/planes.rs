//! Floor and walls: large planes in a depth image.

use super::camera::{RgbdCamera, depth_noise};
use crate::geometry::{Point, Vec3};
use nalgebra::Matrix3;

/// A plane in the camera's frame; the camera is on the side to which the normal points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub(super) normal: Vec3,
    /// `normal · p + offset = 0` on the plane; positive on the camera's side.
    pub(super) offset: f64,
    /// Greatest distance of its points, in metres.
    pub(super) band: f64,
}

/// Spacing of the tested points, in pixels.
const STRIDE: usize = 4;
/// Spacing of the initial guesses, in pixels.
const SEEDS: usize = 20;
/// Least share of the valid points in a plane.
const LEAST_SHARE: f64 = 0.04;
/// Least extent of a plane in both directions, in metres: more than any part of a person.
const LEAST_EXTENT: f64 = 0.8;
/// Greatest number of planes: floor, three walls, ceiling, and one spare.
const MOST: usize = 6;

impl Plane {
    /// Signed distance, positive on the camera's side.
    pub(super) fn height(&self, p: &Point) -> f64 {
        self.normal.dot(&p.coords) + self.offset
    }
}

/// Greatest distance from a plane of a point at depth `z` on it: the noise along the normal.
fn tolerance(z: f64) -> f64 {
    0.008 + 2.0 * depth_noise(z)
}

/// The large planes of a depth image, largest first.
pub(super) fn large_planes(camera: &RgbdCamera, depth: &[f32]) -> Vec<Plane> {
    let mut points: Vec<Point> = Vec::new();
    for row in (0..camera.height).step_by(STRIDE) {
        for column in (0..camera.width).step_by(STRIDE) {
            let z = f64::from(depth[row * camera.width + column]);
            if z > 0.0 {
                points.push(camera.point(column as f64, row as f64, z));
            }
        }
    }
    let least = (LEAST_SHARE * points.len() as f64).max(50.0) as usize;
    let guesses = guesses(camera, depth);
    let mut planes = Vec::new();
    while planes.len() < MOST && points.len() > least {
        let count = |plane: &Plane| points.iter().filter(|p| plane.height(p).abs() < tolerance(p.z)).count();
        let Some((_, guess)) = guesses.iter().map(|g| (count(g), g)).reduce(|a, b| if b.0 > a.0 { b } else { a })
        else {
            break;
        };
        let Some(plane) = refined(guess, &points) else { break };
        let on: Vec<Point> = points.iter().copied().filter(|p| plane.height(p).abs() < tolerance(p.z)).collect();
        if on.len() < least {
            break;
        }
        points.retain(|p| plane.height(p).abs() >= tolerance(p.z));
        if reaches_far(&on) {
            planes.push(plane);
        }
    }
    planes
}

/// Initial guesses spread over the image, by differences over 2 × 12 pixels.
fn guesses(camera: &RgbdCamera, depth: &[f32]) -> Vec<Plane> {
    const ARM: usize = 12;
    let at = |column: usize, row: usize| {
        let z = f64::from(depth[row * camera.width + column]);
        (z > 0.0).then(|| camera.point(column as f64, row as f64, z))
    };
    let mut guesses = Vec::new();
    for row in (ARM..camera.height.saturating_sub(ARM)).step_by(SEEDS) {
        for column in (ARM..camera.width.saturating_sub(ARM)).step_by(SEEDS) {
            let corners =
                [(column - ARM, row), (column + ARM, row), (column, row - ARM), (column, row + ARM), (column, row)];
            let [Some(l), Some(r), Some(a), Some(b), Some(m)] = corners.map(|(x, y)| at(x, y)) else { continue };
            // On a plane the middle point lies on the line between the outer two.
            if (m - nalgebra::center(&l, &r)).norm().max((m - nalgebra::center(&a, &b)).norm()) > 0.1 * m.z {
                continue;
            }
            guesses.extend(plane_through(&m, &(b - a).cross(&(r - l))));
        }
    }
    guesses
}

fn plane_through(p: &Point, normal: &Vec3) -> Option<Plane> {
    let normal = normal.try_normalize(1e-12)?;
    let offset = -normal.dot(&p.coords);
    // The camera is at the origin.
    let (normal, offset) = if offset < 0.0 { (-normal, -offset) } else { (normal, offset) };
    Some(Plane { normal, offset, band: 0.0 })
}

/// Refits the plane to its inliers by least squares, for a few rounds.
fn refined(guess: &Plane, points: &[Point]) -> Option<Plane> {
    let mut plane = *guess;
    for round in 0..6 {
        let wide = if round < 3 { 1.5 } else { 1.0 };
        let on: Vec<&Point> = points.iter().filter(|p| plane.height(p).abs() < wide * tolerance(p.z)).collect();
        if on.len() < 20 {
            return None;
        }
        let middle = on.iter().map(|p| p.coords).sum::<Vec3>() / on.len() as f64;
        let spread: Matrix3<f64> = on.iter().map(|p| (p.coords - middle) * (p.coords - middle).transpose()).sum();
        let eigen = spread.symmetric_eigen();
        let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        plane = plane_through(&Point::from(middle), &normal)?;
        let mut off: Vec<f64> = on.iter().map(|p| plane.height(p).abs()).collect();
        off.sort_by(f64::total_cmp);
        // At most 1.5 cm: with more it would include feet.
        plane.band = (4.0 * 1.4826 * off[off.len() / 2]).clamp(0.008, 0.015);
    }
    Some(plane)
}

fn reaches_far(on: &[Point]) -> bool {
    let middle = on.iter().map(|p| p.coords).sum::<Vec3>() / on.len() as f64;
    let spread: Matrix3<f64> = on.iter().map(|p| (p.coords - middle) * (p.coords - middle).transpose()).sum();
    let eigen = spread.symmetric_eigen();
    let flat = eigen.eigenvalues.imin();
    (0..3).filter(|&k| k != flat).all(|k| {
        let direction = eigen.eigenvectors.column(k);
        let mut along: Vec<f64> = on.iter().map(|p| direction.dot(&p.coords)).collect();
        along.sort_by(f64::total_cmp);
        along[along.len() * 19 / 20] - along[along.len() / 20] > LEAST_EXTENT
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floor_and_wall_are_found_and_a_person_sized_board_is_not() {
        let camera =
            RgbdCamera { width: 424, height: 512, fx: 366.0, fy: 366.0, cx: 211.5, cy: 255.5, distortion: [0.0; 5] };
        let depth: Vec<f32> = (0..424 * 512)
            .map(|i| {
                let ray = camera.point((i % 424) as f64, (i / 424) as f64, 1.0);
                let board = ray.x.abs() < 0.15 && ray.y.abs() < 0.4;
                let floor = if ray.y > 0.0 { 0.9 / ray.y } else { f64::INFINITY };
                let wobble = 1e-3 * ((i * 7919) % 11) as f64;
                (if board { 2.0 } else { floor.min(3.4) } + wobble) as f32
            })
            .collect();
        let planes = large_planes(&camera, &depth);
        assert_eq!(planes.len(), 2, "{planes:?}");
        let floor = planes.iter().find(|p| p.normal.y < -0.9).unwrap();
        assert!((floor.offset - 0.9).abs() < 0.01);
        let wall = planes.iter().find(|p| p.normal.z < -0.9).unwrap();
        assert!((wall.offset - 3.4).abs() < 0.02);
    }
}
