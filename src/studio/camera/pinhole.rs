//! A pinhole camera and its place around the person.

use crate::geometry::{Point, Vec3};
use nalgebra::{Isometry3, Point2, UnitQuaternion};

/// Intrinsics of a pinhole camera without distortion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Focal length, pixels.
    pub focal: f64,
}

impl Default for Lens {
    /// A second-generation Kinect, upright.
    fn default() -> Self {
        Self { width: 424, height: 512, focal: 366.0 }
    }
}

impl Lens {
    /// The principal point: pixels, column and row; 0 is the middle of the first pixel.
    pub fn center(&self) -> [f64; 2] {
        [0.5 * self.width as f64 - 0.5, 0.5 * self.height as f64 - 0.5]
    }
}

/// A pinhole camera with its pose. Its frame: x right, y down, z forward.
#[derive(Clone, Debug)]
pub struct PosedCamera {
    pub(super) camera_from_world: Isometry3<f64>,
    pub(super) lens: Lens,
}

impl PosedCamera {
    /// `count` level cameras at the height of `center`, `distance` metres from the vertical through it: `turns` turns of
    /// a turntable, in the frame of the person.
    pub(super) fn ring(center: &Point, distance: f64, count: usize, turns: f64, lens: &Lens) -> Vec<Self> {
        (0..count)
            .map(|i| {
                let around = turns * std::f64::consts::TAU * i as f64 / count as f64;
                let eye = center + Vec3::new(around.sin(), 0.0, around.cos()) * distance;
                let camera_from_world = Isometry3::look_at_rh(&eye, center, &Vec3::y());
                // OpenGL's frame looks along −z with y up.
                let turned = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI);
                Self { camera_from_world: turned * camera_from_world, lens: *lens }
            })
            .collect()
    }

    /// The pixel (column, row) onto which a point of the camera's frame projects.
    pub(super) fn pixel(&self, p: &Point) -> Point2<f64> {
        let [cx, cy] = self.lens.center();
        Point2::new(self.lens.focal * p.x / p.z + cx, self.lens.focal * p.y / p.z + cy)
    }

    /// The point of the camera's frame at a pixel and a depth along z, metres.
    pub(super) fn point(&self, x: f64, y: f64, depth: f64) -> Point {
        let [cx, cy] = self.lens.center();
        Point::new((x - cx) / self.lens.focal * depth, (y - cy) / self.lens.focal * depth, depth)
    }
}
