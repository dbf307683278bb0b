//! Builds a pose library: from clips, and from poses within the limits of the joints that no clip contains.

use super::calibration::at_joints;
use super::error::DriveError;
use super::landmark::Places;
use super::recognition::{
    BodyRotations, PoseClasses, PoseLibrary, SalientAngle, body_rotations, mirrored, pose_features, pose_of,
    random_poses, select_angles, thin,
};
use crate::body::HumanJoint::{self, Chest, LowerArm, LowerLeg, Neck, Spine, UpperArm, UpperChest, UpperLeg};
use crate::body::{Figure, Pose, Side, Skeleton};
use crate::fit::Attached;
use crate::geometry::Vec3;
use crate::motion::Anatomy;
use crate::numerics::Rng;
use nalgebra::{Quaternion, UnitQuaternion};

/// The source of poses that come from no clip.
const RANDOM: &str = "random";

/// The library that comes with the program: of our own clips, by `drive train` with its defaults.
pub fn embedded_library() -> Result<PoseLibrary, DriveError> {
    Ok(PoseLibrary::read(include_bytes!("../../templates/poses/library.poses"))?)
}

/// What a library is built from, beside its clips.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainingParams {
    /// Poses of clips differ by at least this in some joint, in radians.
    pub least_angle: f64,
    /// Mixes of the limbs of clips, and as many poses drawn within the limits of the joints.
    pub random: usize,
    /// Seed of those.
    pub seed: u64,
    /// Classes of poses.
    pub classes: usize,
    /// Angles of the descriptor.
    pub angles: usize,
}

impl Default for TrainingParams {
    fn default() -> Self {
        Self { least_angle: 0.3, random: 250, seed: 2019, classes: 24, angles: 40 }
    }
}

/// How a library came out.
#[derive(Clone, Debug)]
pub struct TrainingReport {
    /// Poses of each class.
    pub sizes: Vec<usize>,
    /// The selected angles, the most salient first.
    pub angles: Vec<SalientAngle>,
}

/// Builds a library from the poses of clips on a figure; every pose is there mirrored, too.
///
/// **Errors** if there are too few poses for classes.
///
/// **Guarantees** equal arguments give equal bytes.
pub fn train_library(
    figure: &Figure,
    clips: &[(String, Vec<Pose>)],
    params: &TrainingParams,
) -> Result<(PoseLibrary, TrainingReport), DriveError> {
    let skeleton = &figure.skeleton;
    let anatomy = Anatomy::new(skeleton);
    let mut sources: Vec<String> = Vec::new();
    let (mut poses, mut source_of): (Vec<BodyRotations>, Vec<usize>) = (Vec::new(), Vec::new());
    for (name, track) in clips {
        let all: Vec<BodyRotations> = track.iter().map(|pose| level(body_rotations(skeleton, pose))).collect();
        for k in thin(&all, params.least_angle) {
            poses.push(all[k]);
            source_of.push(sources.len());
        }
        sources.push(name.clone());
    }
    let limited = |_: &Skeleton, pose: &Pose| anatomy.limited(pose).0;
    let mut free = random_poses(skeleton, &poses, params.random, params.seed, limited);
    let mut rng = Rng::new(params.seed ^ 0xA5A5);
    free.extend((0..params.random).map(|_| body_rotations(skeleton, &drawn(skeleton, &anatomy, &mut rng))));
    source_of.extend(free.iter().map(|_| sources.len()));
    sources.push(RANDOM.into());
    poses.extend(free);
    let count = poses.len();
    for k in 0..count {
        poses.push(mirrored_pose(skeleton, &poses[k]));
        source_of.push(source_of[k]);
    }
    let attached = at_joints(skeleton);
    let places: Vec<Places> =
        poses.iter().map(|pose| places_of(&attached, skeleton, &pose_of(skeleton, pose))).collect();
    let features: Vec<Vec<f64>> = places.iter().filter_map(pose_features).collect();
    if features.len() < places.len() {
        return Err(DriveError::Untrainable { why: "a pose has two landmarks at the same place".into() });
    }
    let classes = PoseClasses::cluster(&features, params.classes);
    let labels = classes.labels.clone();
    let of_mirrored: Vec<usize> =
        places.iter().map(|p| pose_features(&mirrored(p)).map_or(0, |features| classes.nearest(&features))).collect();
    let angles = select_angles(&places, &labels, &of_mirrored, params.angles)?;
    let report = TrainingReport { sizes: classes.sizes(), angles: angles.clone() };
    let angles = angles.into_iter().map(|salient| salient.angle).collect();
    let library = PoseLibrary::try_new(angles, poses, labels, sources, source_of)?;
    Ok((library, report))
}

/// All landmarks of a pose.
pub(super) fn places_of(attached: &Attached, skeleton: &Skeleton, pose: &Pose) -> Places {
    let points = attached.posed(skeleton, pose);
    std::array::from_fn(|k| Some(points.as_slice()[k]))
}

/// A pose without its heading: the descriptor does not see it.
fn level(mut pose: BodyRotations) -> BodyRotations {
    let forward = pose[0] * Vec3::z();
    pose[0] = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), -forward.x.atan2(forward.z)) * pose[0];
    pose
}

/// The mirror image of a pose.
fn mirrored_pose(skeleton: &Skeleton, rotations: &BodyRotations) -> BodyRotations {
    let pose = pose_of(skeleton, rotations);
    let mut image = pose.clone();
    for j in skeleton.ids() {
        let r = pose.rotations[skeleton.mirrored(j).unwrap_or(j).index()];
        image.rotations[j.index()] = UnitQuaternion::new_unchecked(Quaternion::new(r.w, r.i, -r.j, -r.k));
    }
    body_rotations(skeleton, &image)
}

/// A pose drawn within the limits of the joints: arms anywhere, legs that may lift, a trunk that bends a little.
fn drawn(skeleton: &Skeleton, anatomy: &Anatomy, rng: &mut Rng) -> Pose {
    let mut pose = Pose::bind(skeleton.len());
    let mut set = |joint: HumanJoint, degrees: [f64; 3]| {
        let Some(j) = skeleton.find(joint) else { return };
        let sign = joint.side().map_or(1.0, Side::sign);
        let [x, y, z] = degrees.map(f64::to_radians);
        anatomy.set(&mut pose, j, &UnitQuaternion::from_scaled_axis(Vec3::new(x, y * sign, z * sign)));
    };
    for side in Side::BOTH {
        // Flexion is negative about x for hip, elbow and shoulder; abduction positive about z.
        set(UpperArm(side), [rng.between(-150.0, 40.0), rng.between(-50.0, 50.0), rng.between(-10.0, 120.0)]);
        set(LowerArm(side), [rng.between(-130.0, 0.0), rng.between(-40.0, 40.0), 0.0]);
        set(UpperLeg(side), [rng.between(-90.0, 20.0), rng.between(-20.0, 30.0), rng.between(-10.0, 35.0)]);
        set(LowerLeg(side), [rng.between(0.0, 110.0), 0.0, 0.0]);
    }
    let trunk = [rng.between(-10.0, 35.0), rng.between(-25.0, 25.0), rng.between(-15.0, 15.0)];
    for (joint, share) in [(Spine, 0.5), (Chest, 0.3), (UpperChest, 0.2)] {
        set(joint, trunk.map(|x| x * share));
    }
    set(Neck, [rng.between(-15.0, 15.0), rng.between(-30.0, 30.0), 0.0]);
    anatomy.limited(&pose).0
}
