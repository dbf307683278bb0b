//! Transforms between the file's frame and unit and the world.

use crate::geometry::{Point, Vec3};
use nalgebra::UnitQuaternion;
use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// `world = rotation · (metres_per_unit · (file − origin))`. Scans near the origin of their file keep their place: only of
/// those far away, such as surveyed ones, the origin is another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileFrame {
    /// The point of the file that is the world's origin.
    pub origin: Vec3,
    /// Metres per unit of the file.
    pub metres_per_unit: f64,
    /// Rotates the file's up axis to +Y.
    pub rotation: UnitQuaternion<f64>,
}

impl FileFrame {
    /// A file already in the world frame.
    pub fn identity() -> Self {
        Self { origin: Vec3::zeros(), metres_per_unit: 1.0, rotation: UnitQuaternion::identity() }
    }
    /// A point of the file in the world.
    pub fn world_from_file(&self, p: &Point) -> Point {
        self.rotation * Point::from((p.coords - self.origin) * self.metres_per_unit)
    }
    /// A point of the world in the file.
    pub fn file_from_world(&self, p: &Point) -> Point {
        Point::from((self.rotation.inverse() * p.coords) / self.metres_per_unit + self.origin)
    }
    /// A direction of the file in the world.
    pub fn direction_in_world(&self, direction: &Vec3) -> Vec3 {
        self.rotation * direction
    }
}

impl Serialize for FileFrame {
    /// As it was before frames had origins; behind a negative scale, an origin follows.
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.origin == Vec3::zeros() {
            true => (self.metres_per_unit, self.rotation).serialize(serializer),
            false => (-self.metres_per_unit, self.rotation, self.origin).serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for FileFrame {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Parts;
        impl<'de> Visitor<'de> for Parts {
            type Value = FileFrame;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a scale, a rotation, and an origin if the scale is negative")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<FileFrame, A::Error> {
                let missing = || serde::de::Error::custom("a frame of a file is cut short");
                let scale: f64 = seq.next_element()?.ok_or_else(missing)?;
                let rotation = seq.next_element()?.ok_or_else(missing)?;
                let origin = if scale < 0.0 { seq.next_element()?.ok_or_else(missing)? } else { Vec3::zeros() };
                Ok(FileFrame { origin, metres_per_unit: scale.abs(), rotation })
            }
        }
        deserializer.deserialize_tuple(3, Parts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back_is_the_same_point() {
        let rotation = UnitQuaternion::from_euler_angles(-1.5, 0.2, 0.4);
        for origin in [Vec3::zeros(), Vec3::new(4e5, 5e6, 100.0)] {
            let frame = FileFrame { origin, metres_per_unit: 1e-3, rotation };
            let p = Point::new(120.0, -340.0, 1700.0) + origin;
            assert!((frame.file_from_world(&frame.world_from_file(&p)) - p).norm() < 1e-8);
            let stored = serde_json::to_string(&(frame, 7u8)).unwrap();
            assert_eq!(serde_json::from_str::<(FileFrame, u8)>(&stored).unwrap(), (frame, 7));
        }
    }

    #[test]
    fn a_frame_without_origin_is_stored_as_before_there_was_one() {
        let frame = FileFrame { metres_per_unit: 0.01, ..FileFrame::identity() };
        let before = serde_json::json!([0.01, [0.0, 0.0, 0.0, 1.0]]);
        assert_eq!(serde_json::to_value(frame).unwrap(), before);
    }
}
