//! Transforms between the file's frame and unit and the world.

use crate::geometry::{Point, Vec3};
use nalgebra::UnitQuaternion;
use serde::{Deserialize, Serialize};

/// Scale and rotation, no translation: `world = rotation · (metres_per_unit · file)`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FileFrame {
    /// Metres per unit of the file.
    pub metres_per_unit: f64,
    /// Rotates the file's up axis to +Y.
    pub rotation: UnitQuaternion<f64>,
}

impl FileFrame {
    /// A file already in the world frame.
    pub fn identity() -> Self {
        Self { metres_per_unit: 1.0, rotation: UnitQuaternion::identity() }
    }
    /// A point of the file in the world.
    pub fn world_from_file(&self, p: &Point) -> Point {
        self.rotation * Point::from(p.coords * self.metres_per_unit)
    }
    /// A point of the world in the file.
    pub fn file_from_world(&self, p: &Point) -> Point {
        Point::from((self.rotation.inverse() * p.coords) / self.metres_per_unit)
    }
    /// A direction of the file in the world.
    pub fn direction_in_world(&self, direction: &Vec3) -> Vec3 {
        self.rotation * direction
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back_is_the_same_point() {
        let frame = FileFrame { metres_per_unit: 1e-3, rotation: UnitQuaternion::from_euler_angles(-1.5, 0.2, 0.4) };
        let p = Point::new(120.0, -340.0, 1700.0);
        assert!((frame.file_from_world(&frame.world_from_file(&p)) - p).norm() < 1e-9);
    }
}
