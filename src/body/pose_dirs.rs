//! Corrective offsets by pose, as the SMPL family has them.

use super::Pose;
use crate::geometry::{PerVertex, Point, Vec3};
use rayon::prelude::*;

/// How far the bind pose's surface gives way, linear in what the joints' rotations are.
///
/// **Shapes** `V × features` offsets, metres a unit of each feature, vertices first.
///
/// **Source** Loper 2015 (SMPL), Eq. 9: features are the entries of `R_j − 1` of all joints but the root, row by row;
/// Osman 2020 (STAR): the quaternion `(x, y, z, w − 1)` of all joints but the root.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseDirs {
    offsets: Vec<Vec3>,
    features: usize,
    kind: Features,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Features {
    /// Nine a joint.
    Matrix,
    /// Four a joint.
    Quaternion,
}

impl PoseDirs {
    /// Offsets for a model of so many joints; `None` if their count is that of no known kind.
    ///
    /// **Requires** `offsets.len()` a multiple of the vertex count `vertices`.
    pub fn try_new(offsets: Vec<Vec3>, vertices: usize, joints: usize) -> Option<Self> {
        let features = offsets.len() / vertices.max(1);
        let turning = joints.saturating_sub(1);
        let kind = match features {
            0 => return None,
            n if n == 9 * turning => Features::Matrix,
            n if n == 4 * turning => Features::Quaternion,
            _ => return None,
        };
        (offsets.len() == features * vertices).then_some(Self { offsets, features, kind })
    }

    /// How many features a vertex has.
    pub fn feature_count(&self) -> usize {
        self.features
    }

    /// Offsets a feature, vertex after vertex.
    pub fn offsets(&self) -> &[Vec3] {
        &self.offsets
    }

    /// Points of the bind pose, given way to `pose`.
    pub fn corrected(&self, points_in_bind: &PerVertex<Point>, pose: &Pose) -> PerVertex<Point> {
        let features = self.features_of(pose);
        points_in_bind
            .0
            .par_iter()
            .zip(self.offsets.par_chunks(self.features))
            .map(|(p, row)| p + row.iter().zip(&features).map(|(offset, f)| offset * *f).sum::<Vec3>())
            .collect::<Vec<_>>()
            .into()
    }

    fn features_of(&self, pose: &Pose) -> Vec<f64> {
        let turning = pose.rotations.iter().skip(1);
        match self.kind {
            Features::Matrix => turning
                .flat_map(|r| {
                    let m = r.to_rotation_matrix().into_inner() - nalgebra::Matrix3::identity();
                    (0..9).map(move |k| m[(k / 3, k % 3)])
                })
                .collect(),
            // q and −q are one rotation; STAR was trained on those with w ≥ 0.
            Features::Quaternion => turning
                .flat_map(|r| {
                    let q = if r.w < 0.0 { -r.into_inner() } else { r.into_inner() };
                    [q.i, q.j, q.k, q.w - 1.0]
                })
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    #[test]
    fn the_bind_pose_moves_nothing_and_a_bent_joint_moves_what_it_is_told_to() {
        let points: PerVertex<Point> = vec![Point::origin(), Point::new(0.0, 1.0, 0.0)].into();
        for (features, feature) in [(9, 1), (4, 2)] {
            let mut offsets = vec![Vec3::zeros(); 2 * features];
            offsets[features + feature] = Vec3::new(0.0, 0.0, 0.5);
            let dirs = PoseDirs::try_new(offsets, 2, 2).unwrap();
            assert_eq!(dirs.corrected(&points, &Pose::bind(2)), points);
            let mut pose = Pose::bind(2);
            pose.rotations[1] = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), 0.3);
            let moved = dirs.corrected(&points, &pose);
            // Entry (0, 1) of the matrix is −sin 0.3; z of the quaternion is sin 0.15.
            let expected = if features == 9 { -0.3f64.sin() } else { 0.15f64.sin() };
            assert!((moved.0[1].z - 0.5 * expected).abs() < 1e-12);
            assert_eq!(moved.0[0], points.0[0]);
        }
        assert!(PoseDirs::try_new(vec![Vec3::zeros(); 10], 2, 2).is_none());
    }
}
