//! The axis that the person turned about, and the deviations from it.

use crate::geometry::{Point, Vec3};
use crate::numerics::wrapped_angle;
use nalgebra::{Isometry3, Matrix3, Translation3, Unit, UnitQuaternion};
use std::f64::consts::PI;

/// A line in the model's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis {
    pub(super) point: Point,
    pub(super) direction: Unit<Vec3>,
}

/// Deviations of poses from a turn about one axis.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Unsteadiness {
    /// Shift of the person's middle, root mean square over the frames, in metres.
    pub(super) shift: f64,
    /// Tilt, root mean square over the frames, in radians.
    pub(super) tilt: f64,
}

/// Least difference of the headings of two frames that determine the axis, in radians: 20°.
const LEAST_TURN: f64 = 0.35;

impl Axis {
    /// A turn about the axis, in radians.
    pub(super) fn turn(&self, angle: f64) -> Isometry3<f64> {
        let rotation = UnitQuaternion::from_axis_angle(&self.direction, angle);
        let shift = self.point.coords - rotation * self.point.coords;
        Isometry3::from_parts(Translation3::from(shift), rotation)
    }

    /// How far a motion turns about the axis, in radians, −π to π.
    pub(super) fn angle_of(&self, motion: &UnitQuaternion<f64>) -> f64 {
        // The twist of the swing–twist decomposition.
        let twist = 2.0 * motion.imag().dot(&self.direction).atan2(motion.w);
        wrapped_angle(twist)
    }

    /// Headings of the frames relative to the first, unwrapped: each within half a turn of the previous one.
    pub(super) fn headings(&self, poses: &[Isometry3<f64>]) -> Vec<f64> {
        let mut headings = vec![0.0; poses.len()];
        for k in 1..poses.len() {
            headings[k] = headings[k - 1] + self.angle_of(&(poses[k] * poses[k - 1].inverse()).rotation);
        }
        headings
    }

    /// The common axis of poses `model_from_camera` in order, near `self`; `None` if they turn too little.
    ///
    /// The direction is the mean axis of the turns between frames, weighted by the turn; the point is the one
    /// that those motions move least.
    pub(super) fn fitted(&self, poses: &[Isometry3<f64>]) -> Option<Self> {
        let headings = self.headings(poses);
        let pairs: Vec<(usize, usize)> = (0..poses.len())
            .filter_map(|k| {
                (k + 1..poses.len())
                    .find(|&j| (LEAST_TURN..PI).contains(&(headings[j] - headings[k]).abs()))
                    .map(|j| (k, j))
            })
            .collect();
        let motions: Vec<Isometry3<f64>> = pairs.iter().map(|&(k, j)| poses[j] * poses[k].inverse()).collect();
        let sum: Vec3 = motions
            .iter()
            .map(|m| {
                let turn = m.rotation.scaled_axis();
                if turn.dot(&self.direction) < 0.0 { -turn } else { turn }
            })
            .sum();
        let direction = Unit::try_new(sum, 1e-6)?;
        // (1 − R) c = t across the axis. Along the axis c is undetermined and keeps its old height.
        let along = direction.into_inner() * direction.transpose();
        let (mut matrix, mut vector) = (along * motions.len() as f64, along * self.point.coords * motions.len() as f64);
        for m in &motions {
            let a = Matrix3::identity() - m.rotation.to_rotation_matrix().into_inner();
            let across = (Matrix3::identity() - along) * a;
            matrix += across.transpose() * across;
            vector += across.transpose() * ((Matrix3::identity() - along) * m.translation.vector);
        }
        let point = matrix.cholesky()?.solve(&vector);
        Some(Self { point: Point::from(point), direction })
    }

    /// How far poses are from a pure turn of their mean about the axis; `middle` is where shifts are measured.
    pub(super) fn unsteadiness(&self, poses: &[Isometry3<f64>], middle: &Point) -> Unsteadiness {
        let Some(first) = poses.first() else { return Unsteadiness::default() };
        // Each pose rotated back: all equal if the turn is pure.
        let headings = self.headings(poses);
        let back: Vec<Isometry3<f64>> =
            poses.iter().zip(&headings).map(|(pose, &angle)| self.turn(-angle) * pose * first.inverse()).collect();
        let moved: Vec<Vec3> = back.iter().map(|m| (m * middle).coords).collect();
        let tilts: Vec<Vec3> = back.iter().map(|m| m.rotation.scaled_axis()).collect();
        let spread = |values: &[Vec3]| {
            let mean = values.iter().sum::<Vec3>() / values.len() as f64;
            (values.iter().map(|v| (v - mean).norm_squared()).sum::<f64>() / values.len() as f64).sqrt()
        };
        Unsteadiness { shift: spread(&moved), tilt: spread(&tilts) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn the_axis_of_a_turn_is_found_and_a_lean_is_reported() {
        let axis =
            Axis { point: Point::new(0.1, 0.0, -0.05), direction: Unit::new_normalize(Vec3::new(0.02, 1.0, -0.03)) };
        let start = Isometry3::new(Vec3::new(0.0, 0.9, 2.0), Vec3::new(3.0, 0.1, 0.0));
        let poses: Vec<_> = (0..72).map(|k| axis.turn(-(k as f64) * TAU / 72.0) * start).collect();
        let guess = Axis { point: Point::origin(), direction: Vec3::y_axis() };
        let found = guess.fitted(&poses).unwrap();
        assert!((found.direction.into_inner() - axis.direction.into_inner()).norm() < 1e-9);
        let off = found.point - axis.point;
        assert!((off - axis.direction.into_inner() * off.dot(&axis.direction)).norm() < 1e-9, "{off}");
        let middle = Point::new(0.0, 0.9, 0.0);
        assert!(found.unsteadiness(&poses, &middle).shift < 1e-9);
        assert!((found.headings(&poses)[71] + TAU * 71.0 / 72.0).abs() < 1e-9);
        let swaying: Vec<_> = poses
            .iter()
            .enumerate()
            .map(|(k, p)| Isometry3::translation(0.01 * (k as f64 * TAU / 72.0).sin(), 0.0, 0.0) * p)
            .collect();
        let deviation = guess.fitted(&swaying).unwrap().unsteadiness(&swaying, &middle);
        assert!((3e-3..0.012).contains(&deviation.shift), "{}", deviation.shift);
    }
}
