//! How a scan is read and cleaned, with units and axes.

use super::error::ScanError;
use super::remesh::Remesh;
use crate::geometry::Vec3;
use crate::parameters::{Allowed, Parameters, parameters};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

parameters! {
    /// How a scan is read and cleaned.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct ScanParams {
        /// The file's unit; guessed from the person's height when not given.
        pub unit: Option<Unit> = None;
        /// The person's height in metres. It sets the scale where the file is in no usual unit, and is compared with what is
        /// measured.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub height: Option<f64> = None;
        /// The file's axis that points up; guessed from the person's shape when not given.
        pub up: Option<Up> = None;
        /// More faces than these are decimated. 100 000 are 5 mm edges on an adult: the resolution of the sensors.
        pub faces: usize = 100_000;
        /// Quads that follow the surface instead of the scan's triangles (Hu 2017, §6.2).
        #[serde(skip_serializing_if = "Option::is_none")]
        pub remesh: Option<Remesh> = None;
        /// Taubin passes. Four take a third of a depth camera's noise and leave folds of a centimetre.
        pub smoothing_passes: usize = 4, Allowed::Count(0, 100), "Taubin smoothing passes over the cleaned surface";
    }
}

impl ScanParams {
    /// Whether a scan can be cleaned with these parameters.
    ///
    /// **Errors** a number of faces that is too small for a person, a parameter out of range.
    pub fn check(&self) -> Result<(), ScanError> {
        /// Fewer faces than these lose hands and feet.
        const LEAST_FACES: usize = 2_000;
        if self.faces < LEAST_FACES {
            return Err(ScanError::TooFewFaces { faces: self.faces, least: LEAST_FACES });
        }
        if let Some(height) = self.height.filter(|height| !HEIGHT.contains(height)) {
            return Err(ScanError::BadHeight { height });
        }
        Ok(self.check_values()?)
    }
}

/// A person's height, in metres: from a toddler to the tallest.
pub(super) const HEIGHT: std::ops::RangeInclusive<f64> = 0.4..=2.5;

/// A unit of length used by scanners.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unit {
    /// m.
    #[serde(rename = "m")]
    Metre,
    /// cm.
    #[serde(rename = "cm")]
    Centimetre,
    /// mm.
    #[serde(rename = "mm")]
    Millimetre,
    /// in.
    #[serde(rename = "in")]
    Inch,
    /// dm.
    #[serde(rename = "dm")]
    Decimetre,
}

impl Unit {
    /// All variants.
    pub const ALL: [Self; 5] = [Self::Metre, Self::Decimetre, Self::Centimetre, Self::Millimetre, Self::Inch];

    /// Metres per unit.
    pub fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Centimetre => 0.01,
            Self::Millimetre => 0.001,
            Self::Inch => 0.0254,
            Self::Decimetre => 0.1,
        }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Metre => "m",
            Self::Centimetre => "cm",
            Self::Millimetre => "mm",
            Self::Inch => "in",
            Self::Decimetre => "dm",
        })
    }
}

impl FromStr for Unit {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let known = Self::ALL.into_iter().find(|unit| unit.to_string() == text);
        known.ok_or_else(|| format!("'{text}' is not a known unit; give m, dm, cm, mm or in"))
    }
}

/// Which axis of a file points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Up {
    /// +X.
    #[serde(rename = "x")]
    PlusX,
    /// −X.
    #[serde(rename = "-x")]
    MinusX,
    /// +Y: glTF, and us.
    #[serde(rename = "y")]
    PlusY,
    /// −Y: the frame of a camera.
    #[serde(rename = "-y")]
    MinusY,
    /// +Z: CAD and Blender.
    #[serde(rename = "z")]
    PlusZ,
    /// −Z.
    #[serde(rename = "-z")]
    MinusZ,
}

impl Up {
    /// All variants.
    pub const ALL: [Self; 6] = [Self::PlusX, Self::MinusX, Self::PlusY, Self::MinusY, Self::PlusZ, Self::MinusZ];

    /// The axis, in the file.
    pub fn direction(self) -> Vec3 {
        match self {
            Self::PlusX => Vec3::x(),
            Self::MinusX => -Vec3::x(),
            Self::PlusY => Vec3::y(),
            Self::MinusY => -Vec3::y(),
            Self::PlusZ => Vec3::z(),
            Self::MinusZ => -Vec3::z(),
        }
    }

    /// The rotation by quarter turns that maps the axis to +Y. A horizontal Z axis of the file stays as it is.
    pub fn world_from_file(self) -> UnitQuaternion<f64> {
        let rows = match self {
            Self::PlusX => [-Vec3::y(), Vec3::x(), Vec3::z()],
            Self::MinusX => [Vec3::y(), -Vec3::x(), Vec3::z()],
            Self::PlusY => [Vec3::x(), Vec3::y(), Vec3::z()],
            Self::MinusY => [-Vec3::x(), -Vec3::y(), Vec3::z()],
            Self::PlusZ => [Vec3::x(), Vec3::z(), -Vec3::y()],
            Self::MinusZ => [Vec3::x(), -Vec3::z(), Vec3::y()],
        };
        let matrix = Matrix3::from_rows(&rows.map(|row| row.transpose()));
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix))
    }
}

impl fmt::Display for Up {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::PlusX => "x",
            Self::MinusX => "-x",
            Self::PlusY => "y",
            Self::MinusY => "-y",
            Self::PlusZ => "z",
            Self::MinusZ => "-z",
        })
    }
}

impl FromStr for Up {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let plain = text.strip_prefix('+').unwrap_or(text).to_ascii_lowercase();
        let known = Self::ALL.into_iter().find(|up| up.to_string() == plain);
        known.ok_or_else(|| format!("'{text}' is not an axis; give x, y, z, -x, -y or -z"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_up_axis_becomes_y_without_a_mirror() {
        for up in Up::ALL {
            let rotation = up.world_from_file();
            assert!((rotation * up.direction() - Vec3::y()).norm() < 1e-12, "{up}");
            assert!((rotation.to_rotation_matrix().matrix().determinant() - 1.0).abs() < 1e-12);
            assert_eq!(up.to_string().parse::<Up>(), Ok(up));
        }
        for unit in Unit::ALL {
            assert_eq!(unit.to_string().parse::<Unit>(), Ok(unit));
        }
        assert_eq!("+Z".parse::<Up>(), Ok(Up::PlusZ));
        assert!("up".parse::<Up>().is_err() && "ft".parse::<Unit>().is_err());
    }
}
