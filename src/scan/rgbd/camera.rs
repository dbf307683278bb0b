//! The camera that took the frames: a pinhole with a lens.

use crate::geometry::Point;
use nalgebra::{Isometry3, Point3, Vector3};
use serde::{Deserialize, Serialize};

/// A pinhole camera. Its frame: x right, y down, z forward; pixel centres lie at whole numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RgbdCamera {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Focal length across, in pixels.
    pub fx: f64,
    /// Focal length down, in pixels.
    pub fy: f64,
    /// Column of the optical axis.
    pub cx: f64,
    /// Row of the optical axis.
    pub cy: f64,
    /// Brown's distortion in OpenCV's order: k1, k2, p1, p2, k3. Zeros for a lens without distortion.
    pub distortion: [f64; 5],
}

impl RgbdCamera {
    /// The point seen in a pixel (of the pinhole, without distortion) at depth `z`.
    pub fn point(&self, column: f64, row: f64, z: f64) -> Point {
        Point::new((column - self.cx) / self.fx * z, (row - self.cy) / self.fy * z, z)
    }

    /// Where the pinhole sees a point: column and row.
    pub fn pixel(&self, p: &Point) -> [f64; 2] {
        [self.fx * p.x / p.z + self.cx, self.fy * p.y / p.z + self.cy]
    }

    /// Whether the lens distorts.
    pub fn is_distorted(&self) -> bool {
        self.distortion.iter().any(|&k| k != 0.0)
    }

    /// The distorted position of a pinhole pixel.
    ///
    /// **Source** Brown 1971, in OpenCV's form.
    pub fn distorted(&self, column: f64, row: f64) -> [f64; 2] {
        let (x, y) = ((column - self.cx) / self.fx, (row - self.cy) / self.fy);
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let bent_x = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
        let bent_y = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
        [bent_x * self.fx + self.cx, bent_y * self.fy + self.cy]
    }

    /// Per pixel of the pinhole the nearest pixel of the distorted image; `u32::MAX` outside.
    pub(super) fn undistortion(&self) -> Vec<u32> {
        let mut from = Vec::with_capacity(self.width * self.height);
        for row in 0..self.height {
            for column in 0..self.width {
                let [x, y] = self.distorted(column as f64, row as f64).map(f64::round);
                let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
                from.push(if inside { (y as usize * self.width + x as usize) as u32 } else { u32::MAX });
            }
        }
        from
    }

    /// Scales the camera to `factor` times as many pixels in each direction.
    pub fn resized(&self, width: usize, height: usize) -> Self {
        let (sx, sy) = (width as f64 / self.width as f64, height as f64 / self.height as f64);
        Self {
            width,
            height,
            fx: self.fx * sx,
            fy: self.fy * sy,
            cx: (self.cx + 0.5) * sx - 0.5,
            cy: (self.cy + 0.5) * sy - 0.5,
            distortion: self.distortion,
        }
    }
}

/// The rays through the pixels of a posed camera, in the model's frame, in units of a voxel or a block.
pub(super) struct Rays {
    /// The camera's position.
    pub(super) origin: Point3<f32>,
    /// The vector from depth 0 to depth 1 m through the upper left pixel, and its change per column and per row.
    pub(super) first: Vector3<f32>,
    pub(super) across: Vector3<f32>,
    pub(super) down: Vector3<f32>,
}

impl Rays {
    pub(super) fn new(camera: &RgbdCamera, model_from_camera: &Isometry3<f64>, unit: f32) -> Self {
        let inverse = 1.0 / f64::from(unit);
        let axes = model_from_camera.rotation.to_rotation_matrix().into_inner() * inverse;
        Self {
            origin: Point3::from((model_from_camera.translation.vector * inverse).cast()),
            first: (axes * camera.point(0.0, 0.0, 1.0).coords).cast(),
            across: (axes.column(0) / camera.fx).cast(),
            down: (axes.column(1) / camera.fy).cast(),
        }
    }

    /// The vector from depth 0 to depth 1 m through a pixel.
    pub(super) fn through(&self, column: usize, row: usize) -> Vector3<f32> {
        self.first + self.across * column as f32 + self.down * row as f32
    }
}

/// Assumed standard deviation of a depth of `z` metres, in metres.
///
/// **Source** Nguyen, Izadi, Lovell 2012 (Kinect v1); newer cameras are better beyond 1.5 m.
pub(super) fn depth_noise(z: f64) -> f64 {
    1e-3 * (1.2 + 1.9 * (z - 0.4).powi(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_and_its_point_agree_also_at_another_size() {
        let camera = RgbdCamera {
            width: 424,
            height: 512,
            fx: 366.0,
            fy: 365.0,
            cx: 210.0,
            cy: 255.5,
            distortion: [0.1, -0.2, 1e-3, -1e-3, 0.05],
        };
        let p = camera.point(17.0, 301.0, 1.7);
        let [x, y] = camera.pixel(&p);
        assert!((x - 17.0).abs() < 1e-9 && (y - 301.0).abs() < 1e-9);
        let twice = camera.resized(848, 1024);
        let [x, y] = twice.pixel(&p);
        // The middle of the pixel's four.
        assert!((x - 34.5).abs() < 1e-9 && (y - 602.5).abs() < 1e-9, "{x} {y}");
        let centre = camera.distorted(camera.cx, camera.cy);
        assert_eq!(centre, [camera.cx, camera.cy]);
        let [bent, _] = camera.distorted(400.0, camera.cy);
        assert!(bent > 400.0, "k1 > 0 pushes outward near the middle: {bent}");
        assert_eq!(camera.undistortion()[255 * 424 + 210], 255 * 424 + 210);
    }
}
