//! How a subject stands in a scan.

use crate::body::Pose;
use nalgebra::Isometry3;

/// How the subject stands for one scan.
pub struct ScanStance {
    /// Rotations of the joints.
    pub pose: Pose,
    /// Metres by which the chest is expanded.
    pub breath: f64,
    /// Place and heading on the turntable.
    pub file_from_world: Isometry3<f64>,
}
