//! Poses for the library: distinct ones of clips, and natural ones that no clip contains.

use super::library::{BodyRotations, body_rotations, pose_of};
use crate::body::HumanJoint;
use crate::body::Side::{Left, Right};
use crate::body::{Pose, Skeleton};
use crate::numerics::Rng;

/// Shares closer than this to a rotation's opposite have no definite mean.
const ANTIPODAL: f64 = 1e-9;
/// Limbs that are posed independently: arms, legs, and all else. Both legs are one limb, because they balance each other.
const LIMBS: usize = 4;

/// The poses that differ from all kept before them by at least an angle, in radians: the greatest of the differences of the
/// joints' rotations.
///
/// **Guarantees** the positions ascend; the first pose is among them.
pub fn thin(poses: &[BodyRotations], least_angle: f64) -> Vec<usize> {
    // |dot product| of unit quaternions: the cosine of half the angle.
    let most_alike = (least_angle / 2.0).clamp(0.0, std::f64::consts::FRAC_PI_2).cos();
    let differ = |a: &BodyRotations, b: &BodyRotations| {
        a.iter().zip(b).any(|(a, b)| a.coords.dot(&b.coords).abs() <= most_alike)
    };
    let mut kept: Vec<usize> = Vec::new();
    for (k, pose) in poses.iter().enumerate() {
        // Frames that follow each other are alike, so the last ones first.
        if kept.iter().rev().all(|&other| differ(pose, &poses[other])) {
            kept.push(k);
        }
    }
    kept
}

/// Random natural poses: each limb is on the way between those of two poses, and each has another two.
///
/// `within_limits` moves joints within their limits. Nothing keeps limbs from crossing the body.
///
/// **Guarantees** equal seeds give equal poses. Without `poses` there are none.
pub fn random_poses(
    skeleton: &Skeleton,
    poses: &[BodyRotations],
    count: usize,
    seed: u64,
    within_limits: impl Fn(&Skeleton, &Pose) -> Pose,
) -> Vec<BodyRotations> {
    if poses.is_empty() {
        return Vec::new();
    }
    let mut rng = Rng::new(seed);
    let mut drawn = || {
        let index = |rng: &mut Rng| ((rng.unit() * poses.len() as f64) as usize).min(poses.len() - 1);
        let parents = [(); LIMBS].map(|()| (&poses[index(&mut rng)], &poses[index(&mut rng)], rng.unit()));
        let mut mixed = poses[0];
        for (j, joint) in HumanJoint::BODY.into_iter().enumerate() {
            let (from, to, share) = parents[limb_of(joint)];
            mixed[j] = from[j].try_slerp(&to[j], share, ANTIPODAL).unwrap_or(from[j]);
        }
        body_rotations(skeleton, &within_limits(skeleton, &pose_of(skeleton, &mixed)))
    };
    (0..count).map(|_| drawn()).collect()
}

fn limb_of(joint: HumanJoint) -> usize {
    use HumanJoint::{Foot, Hand, LowerArm, LowerLeg, Shoulder, Toes, UpperArm, UpperLeg};
    match joint {
        Shoulder(Left) | UpperArm(Left) | LowerArm(Left) | Hand(Left) => 0,
        Shoulder(Right) | UpperArm(Right) | LowerArm(Right) | Hand(Right) => 1,
        UpperLeg(_) | LowerLeg(_) | Foot(_) | Toes(_) => 2,
        _ => 3,
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::geometry::{Point, Vec3};
    use nalgebra::UnitQuaternion;

    /// Random rotations of up to about a right angle.
    pub fn poses(count: usize, seed: u64) -> Vec<BodyRotations> {
        let mut rng = Rng::new(seed);
        let mut rotation =
            || UnitQuaternion::from_scaled_axis(Vec3::new(rng.normal(), rng.normal(), rng.normal()) * 0.5);
        (0..count).map(|_| std::array::from_fn(|_| rotation())).collect()
    }

    fn skeleton() -> Skeleton {
        let joints_in_bind = vec![Point::origin(); HumanJoint::BODY.len()];
        Skeleton { names: Skeleton::body_names(), parents: Skeleton::body_parents(), joints_in_bind }
    }

    #[test]
    fn similar_poses_are_dropped() {
        let base = poses(1, 4)[0];
        let turned = |degrees: f64| {
            let mut pose = base;
            pose[7] = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), degrees.to_radians()) * base[7];
            pose
        };
        let sequence = [0.0, 4.0, 8.0, 12.0, 16.0, 20.0, 4.0].map(turned);
        assert_eq!(thin(&sequence, 10_f64.to_radians()), [0, 3]);
        let mut opposite = base;
        opposite[3] = UnitQuaternion::new_unchecked(-base[3].into_inner());
        assert_eq!(thin(&[base, opposite], 1e-3), [0]);
        assert!(thin(&[], 1.0).is_empty());
    }
    #[test]
    fn random_poses_mix_limbs_and_respect_the_limits() {
        let (skeleton, given) = (skeleton(), poses(5, 5));
        let unlimited = |_: &Skeleton, pose: &Pose| pose.clone();
        let drawn = random_poses(&skeleton, &given, 50, 6, unlimited);
        assert_eq!(drawn, random_poses(&skeleton, &given, 50, 6, unlimited));
        assert_ne!(drawn, random_poses(&skeleton, &given, 50, 7, unlimited));
        // All joints of a limb are the same share between the same two poses: those of one pose stay together.
        let alone = random_poses(&skeleton, &given[..1], 3, 8, unlimited);
        assert!(alone.iter().flatten().zip(given[0].iter().cycle()).all(|(a, b)| a.angle_to(b) < 1e-6));
        let straight = |skeleton: &Skeleton, pose: &Pose| {
            let mut limited = pose.clone();
            for j in skeleton.ids() {
                if matches!(skeleton.human_joint(j), Some(HumanJoint::LowerArm(_))) {
                    limited.rotations[j.index()] = UnitQuaternion::identity();
                }
            }
            limited
        };
        for pose in random_poses(&skeleton, &given, 10, 9, straight) {
            assert!(pose[8] == UnitQuaternion::identity() && pose[7] != UnitQuaternion::identity());
        }
        assert!(random_poses(&skeleton, &[], 3, 1, unlimited).is_empty());
    }
}
