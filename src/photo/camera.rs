//! The camera of a photo.

use super::error::PhotoError;
use crate::formats::Intrinsics;
use crate::geometry::Vec3;
use nalgebra::{Isometry3, Matrix2x3, UnitQuaternion, Vector2};
use std::f64::consts::PI;

/// A pinhole camera.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotoCamera {
    /// Width and height of the picture in pixels.
    pub size: [usize; 2],
    /// Focal lengths and principal point in pixels: fx, fy, cx, cy.
    pub pinhole: [f64; 4],
    /// From the world (Y up) to the camera (x right, y down, z forward). Without a pose of its own the camera is level, in the
    /// world's origin, and looks along −Z, so that a person who faces it faces +Z.
    pub camera_from_world: Isometry3<f64>,
    /// Whether the pose was given: then the floor is y = 0.
    pub has_floor: bool,
}

/// Focal length of a camera of which nothing is known, as a share of the picture's longer side: the main lens of a phone, 28 mm
/// on film of 36 mm.
const USUAL_FOCAL: f64 = 28.0 / 36.0;

impl PhotoCamera {
    /// The camera of a file; `rows` is its 3 × 4 `camera_from_world`, by rows, if it has one.
    ///
    /// **Errors** a lens with distortion, a camera below the floor.
    pub fn try_new(intrinsics: &Intrinsics, rows: Option<[f64; 12]>) -> Result<Self, PhotoError> {
        if intrinsics.distortion.iter().any(|k| *k != 0.0) {
            return Err(PhotoError::Distorted);
        }
        let pose = rows.map(|m| {
            let linear = nalgebra::Matrix3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]);
            Isometry3::from_parts(Vec3::new(m[3], m[7], m[11]).into(), UnitQuaternion::from_matrix(&linear))
        });
        if pose.is_some_and(|pose| pose.inverse().translation.y <= 0.0) {
            return Err(PhotoError::BelowFloor);
        }
        Ok(Self {
            size: [intrinsics.width, intrinsics.height],
            pinhole: intrinsics.pinhole,
            has_floor: pose.is_some(),
            camera_from_world: pose.unwrap_or_else(level),
        })
    }

    /// A usual camera for a picture of that size.
    pub fn assumed(size: [usize; 2]) -> Self {
        let [width, height] = size.map(|n| n as f64);
        let focal = USUAL_FOCAL * width.max(height);
        let pinhole = [focal, focal, 0.5 * width, 0.5 * height];
        Self { size, pinhole, camera_from_world: level(), has_floor: false }
    }

    /// The pixel of a point of the world; `None` for one that is not in front of the camera.
    pub fn project(&self, p: &Vec3) -> Option<Vector2<f64>> {
        /// Metres: nearer than any person in a photo.
        const NEAREST: f64 = 0.1;
        let q = self.camera_from_world * nalgebra::Point3::from(*p);
        let [fx, fy, cx, cy] = self.pinhole;
        (q.z > NEAREST).then(|| Vector2::new(fx * q.x / q.z + cx, fy * q.y / q.z + cy))
    }

    /// How the pixel moves with the point, in pixels per metre.
    pub(super) fn derivative(&self, p: &Vec3) -> Matrix2x3<f64> {
        let q = self.camera_from_world * nalgebra::Point3::from(*p);
        let [fx, fy, ..] = self.pinhole;
        let in_camera = Matrix2x3::new(fx / q.z, 0.0, -fx * q.x / (q.z * q.z), 0.0, fy / q.z, -fy * q.y / (q.z * q.z));
        in_camera * self.camera_from_world.rotation.to_rotation_matrix().matrix()
    }

    /// The point of the world behind a pixel, `depth` metres along the camera's axis.
    pub(super) fn behind(&self, pixel: &Vector2<f64>, depth: f64) -> Vec3 {
        let [fx, fy, cx, cy] = self.pinhole;
        let q = nalgebra::Point3::new((pixel.x - cx) / fx * depth, (pixel.y - cy) / fy * depth, depth);
        self.camera_from_world.inverse_transform_point(&q).coords
    }

    /// Where the camera is in the world.
    pub(super) fn center(&self) -> Vec3 {
        self.camera_from_world.inverse_transform_point(&nalgebra::Point3::origin()).coords
    }
}

fn level() -> Isometry3<f64> {
    Isometry3::from_parts(Vec3::zeros().into(), UnitQuaternion::from_axis_angle(&Vec3::x_axis(), PI))
}
