//! What is known about a pose before a photo is seen.

use super::anchor::Rig;
use crate::body::{Figure, HumanJoint, JointId, Pose, Side, Stance};
use crate::geometry::Vec3;
use crate::motion::{MotionParams, clips_of_prior, follow};
use crate::numerics::Rng;
use nalgebra::{Matrix3, UnitQuaternion};

/// The Gaussian of each turning joint's rotation vector, in its anatomical axes.
///
/// **Source** in place of the mixture of Bogo 2016, whose data are not free: moments of the poses of our own clips, with a deep
/// squat, and stances, each also mirrored, and of random poses within the joint limits.
///
/// **Shapes** one entry per turning joint but the root; mean, and `W` with `Wᵀ W` the inverse covariance.
pub(super) struct PosePrior {
    pub joints: Vec<(Vec3, Matrix3<f64>)>,
}

/// Of the 300 frames of a clip one in so many: neighbours are alike.
const FRAME_STEP: usize = 25;
/// How often each stance counts: as often as a clip, whose frames are one activity.
const STANCE_COUNT: usize = 12;
/// Random poses per pose of clips and stances: clips and stances hardly combine a raised arm with a bent elbow.
const RANDOM_SHARE: f64 = 0.35;
/// Greatest random turn of a joint before its limits apply, in radians, about each axis.
const RANDOM_TURN: f64 = 1.2;
/// Greatest random bend of an elbow or knee, in radians: its limit.
const GREATEST_BEND: f64 = 2.6;
/// Least standard deviation, in radians: clips do not move the collar bones at all.
const LEAST_SIGMA: f64 = 0.08;

impl PosePrior {
    /// The prior for a model's skeleton.
    pub fn new(rig: &Rig<'_>) -> Self {
        let samples = samples(rig);
        let skeleton = &rig.model.skeleton;
        let joints = rig.turning.iter().filter(|&&j| j != 0).map(|&j| {
            let joint = JointId(j as u16);
            let mirrored = skeleton.mirrored(joint).unwrap_or(joint);
            let vectors: Vec<Vec3> = samples
                .iter()
                .flat_map(|pose| {
                    let other = rig.anatomy.rotation(pose, mirrored).scaled_axis();
                    [rig.anatomy.rotation(pose, joint).scaled_axis(), Vec3::new(other.x, -other.y, -other.z)]
                })
                .collect();
            gaussian(&vectors)
        });
        Self { joints: joints.collect() }
    }

    /// The pose whose joints have their expected rotations.
    pub fn mean_pose(&self, rig: &Rig<'_>) -> Pose {
        let mut pose = Pose::bind(rig.model.skeleton.len());
        for (&j, (mean, _)) in rig.turning.iter().filter(|&&j| j != 0).zip(&self.joints) {
            rig.anatomy.set(&mut pose, JointId(j as u16), &UnitQuaternion::from_scaled_axis(*mean));
        }
        pose
    }
}

fn samples(rig: &Rig<'_>) -> Vec<Pose> {
    let model = rig.model;
    let figure = Figure::mean(model);
    let mut poses = Vec::new();
    for clip in clips_of_prior() {
        // A rig that a clip cannot be carried to has the stances alone.
        if let Ok((track, _)) = follow(&clip, &figure, None, None, &MotionParams::default()) {
            poses.extend(track.poses.into_iter().skip(track.lead).step_by(FRAME_STEP));
        }
    }
    for stance in Stance::ALL {
        poses.extend(vec![stance.pose(&model.skeleton); STANCE_COUNT]);
    }
    let count = (poses.len() as f64 * RANDOM_SHARE) as usize;
    let mut rng = Rng::new(0);
    poses.extend((0..count).map(|_| random_pose(rig, &mut rng)));
    poses
}

/// A random pose within the limits of the joints.
fn random_pose(rig: &Rig<'_>, rng: &mut Rng) -> Pose {
    let (anatomy, skeleton) = (rig.anatomy, &rig.model.skeleton);
    let mut pose = Pose::bind(skeleton.len());
    for j in skeleton.ids().skip(1).filter(|&j| skeleton.human_joint(j).is_some()) {
        let mut turn = || rng.between(-RANDOM_TURN, RANDOM_TURN);
        let mut vector = Vec3::new(turn(), turn(), turn());
        // Knees and elbows bend one way only.
        if let Some((_, sign)) = hinges().into_iter().find(|(human, _)| skeleton.human_joint(j) == Some(*human)) {
            vector.x = sign * vector.x.abs() * (GREATEST_BEND / RANDOM_TURN);
        }
        anatomy.set(&mut pose, j, &UnitQuaternion::from_scaled_axis(vector));
    }
    anatomy.limited(&pose).0
}

fn gaussian(vectors: &[Vec3]) -> (Vec3, Matrix3<f64>) {
    let count = vectors.len().max(1) as f64;
    let mean = vectors.iter().sum::<Vec3>() / count;
    let spread = vectors.iter().map(|v| (v - mean) * (v - mean).transpose()).sum::<Matrix3<f64>>() / count;
    let covariance = spread + Matrix3::identity() * LEAST_SIGMA.powi(2);
    let inverse = covariance.cholesky().expect("a covariance plus a positive diagonal is positive definite").inverse();
    let root = inverse.cholesky().expect("the inverse of a positive definite matrix is one").l().transpose();
    (mean, root)
}

/// The sign of the flexion about x of the joints that bend one way only.
pub(super) fn hinges() -> [(HumanJoint, f64); 4] {
    let knees = Side::BOTH.map(|side| (HumanJoint::LowerLeg(side), 1.0));
    let elbows = Side::BOTH.map(|side| (HumanJoint::LowerArm(side), -1.0));
    [knees[0], knees[1], elbows[0], elbows[1]]
}

/// How a rotation vector changes with a small turn after its rotation: the inverse right Jacobian of the rotation group.
pub(super) fn vector_from_turn(v: &Vec3) -> Matrix3<f64> {
    let angle = v.norm();
    let cross = v.cross_matrix();
    let second = if angle < 1e-4 {
        1.0 / 12.0
    } else {
        1.0 / (angle * angle) - (1.0 + angle.cos()) / (2.0 * angle * angle.sin())
    };
    // Near half a turn the vector jumps to the other side: there no derivative holds.
    let second = if second.is_finite() { second.clamp(0.0, 1.0) } else { 0.0 };
    Matrix3::identity() + cross * 0.5 + cross * cross * second
}
