//! Dual quaternion skinning: rigid motions are blended as such, so that twisted limbs keep their volume.

use super::skin::check_lengths;
use super::{Pose, Skeleton, SkinRow, SkinWeights, skin};
use crate::geometry::{PerVertex, Point, Vec3};
use nalgebra::{Isometry3, Quaternion};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How joints move surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Skinning {
    /// Linear blend skinning: matrices are blended. Twisted and strongly bent joints lose volume; every program does it.
    #[default]
    #[serde(rename = "lbs")]
    Linear,
    /// Dual quaternions are blended. Joints keep their volume, and bulge a little where they bend.
    #[serde(rename = "dq")]
    DualQuaternion,
}

impl Skinning {
    /// Both, with their names on the command line and in files.
    pub const ALL: [(&'static str, Self); 2] = [("lbs", Self::Linear), ("dq", Self::DualQuaternion)];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "lbs",
            Self::DualQuaternion => "dq",
        }
    }

    /// Moves points from the bind pose into `pose`; the model's corrective offsets apply before, as in [`skin`].
    ///
    /// **Shapes** `V × 3` in and out, with `V` rows of weights and one rotation per joint.
    ///
    /// # Panics
    /// If the shapes are others.
    pub fn skin(
        self,
        points_in_bind: &PerVertex<Point>,
        weights: &SkinWeights,
        skeleton: &Skeleton,
        pose: &Pose,
    ) -> PerVertex<Point> {
        match self {
            Self::Linear => skin(points_in_bind, weights, skeleton, pose),
            Self::DualQuaternion => skin_by_dual_quaternions(points_in_bind, weights, skeleton, pose),
        }
    }
}

/// A rigid motion: the rotation, and half of the translation times the rotation.
#[derive(Clone, Copy)]
struct DualQuaternion {
    real: Quaternion<f64>,
    dual: Quaternion<f64>,
}

impl DualQuaternion {
    fn of(transform: &Isometry3<f64>) -> Self {
        let real = transform.rotation.into_inner();
        Self { real, dual: Quaternion::from_imag(transform.translation.vector * 0.5) * real }
    }
}

/// **Source** Kavan 2008, Geometric Skinning with Approximate Dual Quaternion Blending, algorithm 1. The signs follow the
/// strongest joint of each vertex.
fn skin_by_dual_quaternions(
    points_in_bind: &PerVertex<Point>,
    weights: &SkinWeights,
    skeleton: &Skeleton,
    pose: &Pose,
) -> PerVertex<Point> {
    check_lengths(points_in_bind, weights, skeleton, pose);
    let points = weights.with_pose_offsets(points_in_bind, pose);
    let motions: Vec<DualQuaternion> = skeleton.world_from_bind(pose).iter().map(DualQuaternion::of).collect();
    let moved: Vec<Point> =
        points.0.par_iter().zip(weights.rows().0.par_iter()).map(|(p, row)| moved(p, row, &motions)).collect();
    moved.into()
}

fn moved(p: &Point, row: &SkinRow, motions: &[DualQuaternion]) -> Point {
    let strongest = motions[row[0].0.index()].real;
    let (mut real, mut dual) = (Quaternion::default(), Quaternion::default());
    for &(j, w) in row.iter().filter(|(_, w)| *w > 0.0) {
        let motion = &motions[j.index()];
        // A rotation and its negative are one rotation; blended with the other sign, they go the long way round.
        let w = if motion.real.coords.dot(&strongest.coords) < 0.0 { -w } else { w };
        real += motion.real * w;
        dual += motion.dual * w;
    }
    let norm = real.norm();
    let (real, dual) = (real / norm, dual / norm);
    let (r, d): (Vec3, Vec3) = (real.imag(), dual.imag());
    let turned = p.coords + r.cross(&(r.cross(&p.coords) + p.coords * real.w)) * 2.0;
    Point::from(turned + (d * real.w - r * dual.w + r.cross(&d)) * 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::JointId;
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;

    /// A tube along x whose second half follows the second joint.
    fn tube() -> (Skeleton, SkinWeights, PerVertex<Point>) {
        let skeleton = Skeleton {
            names: vec!["a".into(), "b".into()],
            parents: vec![None, Some(JointId(0))],
            joints_in_bind: vec![Point::origin(), Point::new(0.5, 0.0, 0.0)],
        };
        let ring = |k: usize| (0..8).map(move |a| (k as f64 * 0.05, f64::from(a) * 0.785));
        let points: PerVertex<Point> =
            (0..21).flat_map(ring).map(|(x, a)| Point::new(x, 0.1 * a.cos(), 0.1 * a.sin())).collect();
        let weights = SkinWeights::from_rows(points.iter().map(|p| {
            let t = ((p.x - 0.3) / 0.4).clamp(0.0, 1.0);
            vec![(JointId(0), 1.0 - t), (JointId(1), t)]
        }));
        (skeleton, weights, points)
    }

    #[test]
    fn a_twisted_tube_keeps_its_radius_and_matrices_lose_it() {
        let (skeleton, weights, points) = tube();
        let mut pose = Pose::bind(2);
        pose.rotations[1] = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), 2.6);
        let least = |skinning: Skinning| {
            let moved = skinning.skin(&points, &weights, &skeleton, &pose);
            moved.iter().map(|p| p.y.hypot(p.z)).fold(f64::INFINITY, f64::min)
        };
        assert!((least(Skinning::DualQuaternion) - 0.1).abs() < 1e-12);
        assert!(least(Skinning::Linear) < 0.05);
    }

    proptest! {
        #[test]
        fn where_one_joint_moves_a_vertex_both_are_rigid_and_equal(
            turn in prop::array::uniform3(-3.0f64..3.0),
            bend in prop::array::uniform3(-3.0f64..3.0),
            translation in prop::array::uniform3(-2.0f64..2.0),
        ) {
            let (skeleton, weights, points) = tube();
            let pose = Pose {
                translation: Vec3::from(translation),
                rotations: [turn, bend].map(|v| UnitQuaternion::from_scaled_axis(Vec3::from(v))).to_vec(),
            };
            let [linear, dual] = Skinning::ALL.map(|(_, skinning)| skinning.skin(&points, &weights, &skeleton, &pose));
            for ((a, b), row) in linear.iter().zip(dual.iter()).zip(weights.rows().iter()) {
                prop_assert!(b.coords.iter().all(|x| x.is_finite()));
                prop_assert!(row[1].1 > 0.0 || (a - b).norm() < 1e-9);
            }
        }
    }

    #[test]
    fn the_bind_pose_moves_nothing() {
        let (skeleton, weights, points) = tube();
        let moved = Skinning::DualQuaternion.skin(&points, &weights, &skeleton, &Pose::bind(2));
        assert!(moved.iter().zip(points.iter()).all(|(a, b)| (a - b).norm() < 1e-12));
    }
}
