//! From keypoints to pose and shape.

use super::anchor::{Anchor, Rig, anchor_of};
use super::camera::PhotoCamera;
use super::capsules::Capsules;
use super::descent::{Solution, minimized};
use super::energy::{Energy, LAST, Sighting, Stage};
use super::error::PhotoError;
use super::flips::unflipped;
use super::keypoints::{Keypoint, Keypoints};
use super::mark::{Layout, Mark};
use super::prior::PosePrior;
use super::size::{UncertainMeasure, spread_of, stature_of};
use crate::body::HumanJoint::{Foot, Hand, LowerArm, LowerLeg, UpperArm, UpperLeg};
use crate::body::{BodyModel, Pose, Shape, Side};
use crate::geometry::{PerVertex, Point, Vec3};
use crate::motion::Anatomy;
use nalgebra::{DMatrix, UnitQuaternion, Vector2};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// What is known beside the keypoints.
#[derive(Clone, Debug)]
pub struct PhotoParams {
    /// The person's stature in metres; without it, it is computed.
    pub height: Option<f64>,
    /// How much is tried.
    pub search: Search,
}

/// How much is tried; measurements compare them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Search {
    /// The mean body in its expected pose, only turned and moved as a whole.
    Rigid,
    /// Every unknown, from the best headings.
    Headings,
    /// As well the depth signs of the bones of each limb.
    Flips,
}

/// A body computed from a photo.
#[derive(Clone, Debug)]
pub struct PhotoBody {
    /// Coordinates in the model's shape space.
    pub shape: Shape,
    /// The pose, in the camera's world: Y up, metres.
    pub pose: Pose,
    /// The camera.
    pub camera: PhotoCamera,
    /// Mean distance in pixels of the keypoints from their projections, without those of `outliers`.
    pub distance: f64,
    /// Keypoints that are far from the body, and that the robust kernel hardly counts.
    pub outliers: usize,
    /// Per keypoint that was used the pixel where the body has it.
    pub projected: Vec<Vector2<f64>>,
    /// The energy: twice the negative log posterior, but for a constant.
    pub energy: f64,
    /// How uncertain the shape is: K × K, the posterior's covariance around the solution (Laplace).
    pub shape_covariance: DMatrix<f64>,
    /// Limb by limb, how many depth signs were changed by the enumeration.
    pub flipped: usize,
}

/// Headings from which the whole body is turned: every 45°.
const HEADINGS: usize = 8;
/// Of the headings, how many are solved to the end.
const KEPT: usize = 3;
/// From stage to stage, factors of the priors (Bogo 2016 lowers its weights as well), and distances in standard deviations at which
/// a keypoint counts a quarter: at first the body is far from its keypoints.
const STAGES: [[f64; 2]; 3] = [[8.0, 30.0], [2.5, 12.0], [1.0, 5.0]];
/// Iterations of the first turn, of each stage, and of the end.
const STEPS: [usize; 3] = [20, 12, 60];
/// Share of keypoints far from the body beyond which keypoints and body disagree.
const MOST_OUTLIERS: f64 = 0.4;
/// The adults that the model and its priors hold for, in metres.
const HEIGHTS: std::ops::RangeInclusive<f64> = 1.2..=2.3;

/// Computes the body of a person in a photo.
///
/// The staged minimisation of Bogo 2016 (SMPLify) with Levenberg–Marquardt: keypoints with a robust kernel, pose prior, bending
/// prior, shape prior, and capsules that must not interpenetrate. The camera is fixed; torso and head give the first place and
/// heading. One view does not show in which direction of depth a bone points, so both are tried for each bone of each limb.
///
/// **Frame and units** world of `camera`: metres, Y up.
///
/// **Errors** a height that no adult has, a model without the joints of a person, keypoints that fit no body.
///
/// **Guarantees** equal arguments give equal bytes, with any number of threads.
///
/// **Source** Bogo 2016, Eqs. 1–5; we differ in the prior (our own poses), in the interpenetration (distances of segments), and in
/// that every term is in units of its standard deviation, so that the curvature at the end is the uncertainty.
pub fn body_from_photo(
    model: &BodyModel,
    keypoints: &Keypoints,
    camera: &PhotoCamera,
    params: &PhotoParams,
) -> Result<PhotoBody, PhotoError> {
    if let Some(height) = params.height.filter(|h| !HEIGHTS.contains(h)) {
        return Err(PhotoError::Height { height });
    }
    let anatomy = Anatomy::new(&model.skeleton);
    let energy = energy_of(model, &anatomy, keypoints, camera, params)?;
    let mut starts = starts(&energy);
    if params.search == Search::Rigid {
        return finished(&energy, starts.swap_remove(0));
    }
    let solved: Vec<Solution> = starts
        .into_par_iter()
        .map(|start| {
            let staged = STAGES.iter().fold(start, |at, &[priors, outlier]| {
                minimized(&energy, at, Stage { only_root: false, priors, outlier }, STEPS[1])
            });
            if params.search == Search::Flips { unflipped(&energy, staged) } else { staged }
        })
        .collect();
    let best = solved.into_iter().min_by(|a, b| a.cost.total_cmp(&b.cost)).expect("there is at least one heading");
    let end = minimized(&energy, best, LAST, STEPS[2]);
    let body = finished(&energy, end)?;
    let keypoints = keypoints.seen.len();
    if body.outliers as f64 > MOST_OUTLIERS * keypoints as f64 {
        return Err(PhotoError::NoAgreement { outliers: body.outliers, keypoints });
    }
    Ok(body)
}

/// The body of a solution.
fn finished(energy: &Energy<'_>, end: Solution) -> Result<PhotoBody, PhotoError> {
    let (distance, outliers) = energy.distance(&end.pose, &end.shape);
    let covariance = covariance(energy, &end);
    let posed = energy.rig.posed(&end.pose, &end.shape);
    let place = |sighting: &Sighting| energy.rig.place(&posed, &end.shape, &sighting.anchor);
    let projected =
        energy.sightings.iter().map(|sighting| energy.camera.project(&place(sighting))).collect::<Option<Vec<_>>>();
    let keypoints = energy.sightings.len();
    let projected = projected.ok_or(PhotoError::NoAgreement { outliers: keypoints, keypoints })?;
    Ok(PhotoBody {
        shape: Shape(end.shape),
        pose: end.pose,
        camera: energy.camera.clone(),
        distance,
        outliers,
        projected,
        energy: end.cost,
        shape_covariance: covariance,
        flipped: end.flipped,
    })
}

/// The keypoints that a perfect tracker finds: where the marks of a body are in the picture, all with confidence 1. Marks behind the
/// camera are left out.
///
/// **Errors** a model without the joints of a person.
pub fn exact_keypoints(
    model: &BodyModel,
    shape: &Shape,
    pose: &Pose,
    camera: &PhotoCamera,
    layout: Layout,
) -> Result<Keypoints, PhotoError> {
    let anatomy = Anatomy::new(&model.skeleton);
    let rig = Rig::new(model, &anatomy);
    let posed = rig.posed(pose, &shape.0);
    let mut seen = Vec::new();
    for mark in layout.marks().into_iter().flatten() {
        let place = rig.place(&posed, &shape.0, &anchor_of(model, mark)?);
        seen.extend(camera.project(&place).map(|at| Keypoint { mark, at, confidence: 1.0 }));
    }
    Ok(Keypoints { layout, seen, size: Some(camera.size) })
}

impl PhotoBody {
    /// The skin in the pose of the photo.
    pub fn posed(&self, model: &BodyModel) -> PerVertex<Point> {
        let (mesh, skeleton) = model.shaped(&self.shape);
        model.posed(mesh.points(), &skeleton, &self.pose)
    }

    /// The joints in the pose of the photo.
    ///
    /// **Shapes** J × 3, metres.
    pub fn joints(&self, model: &BodyModel) -> Vec<Point> {
        model.skeleton_of(&self.shape).joints_in_world(&self.pose)
    }

    /// The body's measures, each with its standard deviation in metres.
    pub fn measures(&self, model: &BodyModel) -> Vec<UncertainMeasure> {
        spread_of(model, &self.shape, &self.shape_covariance)
    }
}

pub(super) fn energy_of<'a>(
    model: &'a BodyModel,
    anatomy: &'a Anatomy<'a>,
    keypoints: &Keypoints,
    camera: &'a PhotoCamera,
    params: &PhotoParams,
) -> Result<Energy<'a>, PhotoError> {
    let rig = Rig::new(model, anatomy);
    let pixels_per_metre = extent(keypoints) / NOSE_TO_HEEL;
    let sightings = keypoints.seen.iter().map(|seen| {
        Ok(Sighting {
            mark: seen.mark,
            anchor: anchor_of(model, seen.mark)?,
            at: seen.at,
            confidence: seen.confidence,
            sigma: TRACKER.hypot(spread_of_mark(seen.mark)) * pixels_per_metre,
        })
    });
    let sightings = sightings.collect::<Result<Vec<_>, PhotoError>>()?;
    Ok(Energy {
        prior: PosePrior::new(&rig),
        capsules: Capsules::new(model),
        soles: if camera.has_floor { soles(model) } else { Vec::new() },
        height: params.height,
        stature: stature_of(model),
        rig,
        camera,
        sightings,
    })
}

/// Error of a tracker in a keypoint, in metres at the person: 3 px of a person 600 px tall.
const TRACKER: f64 = 0.008;
/// Height of the keypoints of a person who stands, in metres, by which pixels become metres.
const NOSE_TO_HEEL: f64 = 1.55;

/// How far marks of the same name are from each other between trackers, annotators and skeletons, in metres: hips and shoulders
/// are inside flesh, elbows, knees and wrists just below the skin.
fn spread_of_mark(mark: Mark) -> f64 {
    match mark {
        Mark::Joint(UpperLeg(_)) | Mark::MidHip => 0.020,
        Mark::Joint(UpperArm(_)) | Mark::Neck => 0.015,
        Mark::Joint(LowerArm(_) | Hand(_) | LowerLeg(_) | Foot(_)) => 0.010,
        Mark::Joint(_) | Mark::Nose | Mark::Eye(_) | Mark::Ear(_) => 0.012,
        Mark::BigToe(_) | Mark::SmallToe(_) | Mark::Heel(_) => 0.015,
    }
}

/// The lowest points of heels and balls of both feet.
fn soles(model: &BodyModel) -> Vec<Anchor> {
    let mut soles = Vec::new();
    for side in Side::BOTH {
        let of_foot: Vec<_> = (model.template.points().enumerate())
            .filter(|(v, _)| model.skeleton.is_part_of(model.weights.rows()[*v][0].0, Foot(side)))
            .collect();
        let depth = |pick: fn(f64, f64) -> f64, from: f64| of_foot.iter().map(|(_, p)| p.z).fold(from, pick);
        let [back, front] = [depth(f64::min, f64::INFINITY), depth(f64::max, f64::NEG_INFINITY)];
        for [from, to] in [[0.0, 0.3], [0.6, 1.0]] {
            let within = |z: f64| (from..=to).contains(&((z - back) / (front - back).max(1e-9)));
            let part = of_foot.iter().filter(|(_, p)| within(p.z));
            let lowest = part.min_by(|a, b| a.1.y.total_cmp(&b.1.y));
            soles.extend(lowest.map(|(v, _)| Anchor::vertex(model, *v)));
        }
    }
    soles
}

/// Height of the keypoints in the picture, in pixels.
fn extent(keypoints: &Keypoints) -> f64 {
    let ys = keypoints.seen.iter().map(|k| k.at.y);
    ys.clone().fold(f64::NEG_INFINITY, f64::max) - ys.fold(f64::INFINITY, f64::min)
}

/// The most different headings that agree best with torso and head.
fn starts(energy: &Energy<'_>) -> Vec<Solution> {
    let expected = energy.prior.mean_pose(&energy.rig);
    let shape = vec![0.0; energy.rig.model.component_count()];
    let mut turned: Vec<Solution> = (0..HEADINGS)
        .into_par_iter()
        .map(|k| {
            let mut pose = expected.clone();
            let heading = TAU * k as f64 / HEADINGS as f64;
            pose.rotations[0] = facing_camera(energy.camera) * about_vertical(heading);
            pose.translation = first_translation(energy, &pose, &shape);
            let start = Solution { pose, shape: shape.clone(), cost: f64::INFINITY, flipped: 0 };
            minimized(energy, start, Stage { only_root: true, priors: 1.0, outlier: STAGES[0][1] }, STEPS[0])
        })
        .collect();
    turned.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let mut kept: Vec<Solution> = Vec::new();
    for solution in turned {
        /// Radians: two headings nearer than this are one.
        const SAME: f64 = 0.35;
        let is_new = kept.iter().all(|other| other.pose.rotations[0].angle_to(&solution.pose.rotations[0]) > SAME);
        if is_new && kept.len() < KEPT {
            kept.push(solution);
        }
    }
    kept
}

fn about_vertical(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vec3::y_axis(), angle)
}

/// The turn about the vertical by which a person faces the camera.
fn facing_camera(camera: &PhotoCamera) -> UnitQuaternion<f64> {
    let toward = camera.camera_from_world.rotation.inverse() * -Vec3::z();
    about_vertical(toward.x.atan2(toward.z))
}

/// Puts the body where its keypoints have their extent in the picture: at the depth that the farthest pair of them gives.
fn first_translation(energy: &Energy<'_>, pose: &Pose, shape: &[f64]) -> Vec3 {
    let posed = energy.rig.posed(&Pose { translation: Vec3::zeros(), ..pose.clone() }, shape);
    let places: Vec<Vec3> = energy.sightings.iter().map(|s| energy.rig.place(&posed, shape, &s.anchor)).collect();
    let center = places.iter().sum::<Vec3>() / places.len() as f64;
    let at = energy.sightings.iter().map(|s| s.at).sum::<Vector2<f64>>() / places.len() as f64;
    // Mean distances from the middle; seen from one side, only the vertical part of the body is not foreshortened.
    let tall: f64 = places.iter().map(|p| (p.y - center.y).abs()).sum();
    let pixels: f64 = energy.sightings.iter().map(|s| (s.at.y - at.y).abs()).sum();
    let depth = energy.camera.pinhole[1] * tall / pixels.max(1.0);
    energy.camera.behind(&at, depth) - center
}

/// The posterior's covariance of the shape: that block of the inverse curvature.
fn covariance(energy: &Energy<'_>, at: &Solution) -> DMatrix<f64> {
    let equations = energy.equations(&at.pose, &at.shape, LAST);
    let (k, first) = (at.shape.len(), energy.rig.shape_at());
    match equations.matrix.cholesky() {
        Some(factor) => factor.inverse().view((first, first), (k, k)).into_owned(),
        // Without curvature nothing is known beyond the prior.
        None => DMatrix::identity(k, k),
    }
}
