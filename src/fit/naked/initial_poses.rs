//! Initial poses of a naked fit: several headings, statures and arm poses are tried and scored.

use super::bent_arms::forearms_are_visible;
use super::coarse_fit::CoarseFit;
use super::problem::NakedProblem;
use crate::body::{BodyModel, HumanJoint, JointId, Pose, Shape, Side, Skeleton};
use crate::fit::correspondence::{ScanSurface, shift_onto};
use crate::fit::solver::Phase;
use crate::geometry::{Point, Vec3, VertexId};
use nalgebra::{Translation3, UnitQuaternion};
use rayon::prelude::*;

/// Headings tried: a quarter of the basin of convergence measured on synthetic subjects (about ±50°).
const HEADINGS: usize = 8;

/// Headings kept for the next round: front, back, and one more.
const KEPT: usize = 3;

/// Rotations of an upper arm from the bind pose, about the axis to the front, in degrees: hanging down, T-pose, and raised
/// in two steps. Their distance is about the basin of convergence (35°).
const ARM_TURNS_DEG: [f64; 4] = [-38.0, 42.0, 85.0, 125.0];

/// A stature further from the mean than this many deviations may be a raised arm or a seated person: the mean is tried too.
const USUAL_STATURE: f64 = 1.8;

/// Statures are clamped to this many deviations.
const GREATEST_STATURE: f64 = 3.0;

/// Above this score more initial poses are tried: right ones score 2 to 4 mm, wrong ones 10 and more. Metres.
const GOOD_START: f64 = 0.006;

/// A pose and a shape with their score: mean distance to the scan in metres, smaller is better.
#[derive(Clone)]
pub(crate) struct InitialPose {
    pub(crate) pose: Pose,
    pub(crate) shape: Shape,
    pub(crate) score: f64,
    pub(crate) name: String,
}

/// Aligns the limbs with the scan.
const LIMBS: Phase =
    Phase { iterations: 6, samples: 0, reach: 0.25, least_cosine: 0.3, limbs_only: true, shape: false };

impl NakedProblem<'_> {
    /// The best of several headings and arm poses. Only feet and face tell front from back, so whole surfaces are compared.
    pub(crate) fn best_initial_pose(&self, coarse: &CoarseFit<'_>, log: &mut Vec<String>) -> InitialPose {
        let scored = |starts: Vec<InitialPose>| -> Vec<InitialPose> {
            starts.into_par_iter().map(|s| InitialPose { score: self.score(&s.pose, &s.shape), ..s }).collect()
        };
        let best_first = |a: &InitialPose, b: &InitialPose| a.score.total_cmp(&b.score);
        let rough = headings(self.model, self.surface, coarse, true);
        let mut finals = scored(with_arms_as_they_are(coarse, &rough));
        finals.sort_by(best_first);
        // A person in the expected pose is found by now. Otherwise other arm poses are tried.
        if finals[0].score > GOOD_START || !forearms_are_visible(self, &finals[0].pose, &finals[0].shape) {
            let fine = headings(self.model, self.surface, coarse, false);
            finals.extend(scored(with_other_arms(self.model, coarse, fine)));
            finals.sort_by(best_first);
        }
        for s in &finals {
            log.push(format!("initial pose {}: score {:.1} mm", s.name, s.score * 1e3));
        }
        finals.swap_remove(0)
    }
}

/// The best headings, best first. Rough ones use half of the points, which suffices if the scan shows only a person.
pub(crate) fn headings(
    model: &BodyModel,
    surface: &ScanSurface,
    coarse: &CoarseFit,
    is_rough: bool,
) -> Vec<InitialPose> {
    let limbs = Phase { samples: if is_rough { 500 } else { 0 }, ..LIMBS };
    let tries: Vec<(usize, Shape)> = shapes_of_height(model, surface)
        .into_iter()
        .flat_map(|shape| (0..HEADINGS).map(move |i| (i, shape.clone())))
        .collect();
    let mut found: Vec<(usize, InitialPose)> = tries
        .into_par_iter()
        .map(|(i, shape)| {
            let heading_deg = i as f64 * 360.0 / HEADINGS as f64;
            let pose = placed(model, surface, coarse, &shape, heading_deg.to_radians());
            (i, fitted(coarse, &limbs, pose, shape, format!("heading {heading_deg:.0}°")))
        })
        .collect();
    found.sort_by(|a, b| a.1.score.total_cmp(&b.1.score));
    let mut kept: Vec<(usize, InitialPose)> = Vec::new();
    for (i, start) in found {
        if kept.len() < KEPT && kept.iter().all(|k| k.0 != i) {
            kept.push((i, start));
        }
    }
    kept.into_iter().map(|k| k.1).collect()
}

/// Fits all joints and the shape from each heading.
pub(crate) fn with_arms_as_they_are(coarse: &CoarseFit, headings: &[InitialPose]) -> Vec<InitialPose> {
    headings.par_iter().map(|start| fitted_longer(coarse, start.clone())).collect()
}

/// Fits all joints and the shape from each heading with the best of several arm poses.
pub(crate) fn with_other_arms(model: &BodyModel, coarse: &CoarseFit, headings: Vec<InitialPose>) -> Vec<InitialPose> {
    headings.into_par_iter().map(|start| fitted_longer(coarse, with_best_arms(model, coarse, &LIMBS, start))).collect()
}

fn fitted_longer(coarse: &CoarseFit, start: InitialPose) -> InitialPose {
    let longer = Phase { iterations: 8, samples: 0, reach: 0.15, least_cosine: 0.3, limbs_only: false, shape: true };
    fitted(coarse, &longer, start.pose, start.shape, start.name)
}

fn fitted(coarse: &CoarseFit, phase: &Phase, pose: Pose, shape: Shape, name: String) -> InitialPose {
    let (pose, shape) = coarse.fit(phase, pose, shape);
    InitialPose { score: coarse.score(&pose, &shape), pose, shape, name }
}

/// Tries poses for one arm at a time and combines the better ones of both sides.
fn with_best_arms(model: &BodyModel, coarse: &CoarseFit, phase: &Phase, start: InitialPose) -> InitialPose {
    let mut best = start.clone();
    for side in Side::BOTH {
        let Some(arm) = model.skeleton.find(HumanJoint::UpperArm(side)) else { continue };
        let tries: Vec<InitialPose> = ARM_TURNS_DEG
            .par_iter()
            .map(|deg| {
                let mut pose = best.pose.clone();
                for j in model.skeleton.ids().filter(|&j| model.skeleton.is_below(j, arm)) {
                    pose.rotations[j.index()] = UnitQuaternion::identity();
                }
                pose.rotations[arm.index()] =
                    UnitQuaternion::from_axis_angle(&Vec3::z_axis(), side.sign() * deg.to_radians());
                let name = format!("{}, {} arm {deg:+.0}°", best.name, side.name());
                fitted(coarse, phase, pose, best.shape.clone(), name)
            })
            .collect();
        for tried in tries {
            if tried.score < best.score {
                best = tried;
            }
        }
    }
    best
}

/// The bind pose with that heading, moved to the scan.
fn placed(model: &BodyModel, surface: &ScanSurface, coarse: &CoarseFit, shape: &Shape, heading: f64) -> Pose {
    let skeleton = model.shaped(shape).1;
    let mut pose = standing(&skeleton, heading, skeleton.joints_in_bind[JointId(0).index()]);
    let (points, areas) = coarse.downsampled.posed(&pose, shape);
    pose.translation += shift_onto(surface, points.iter().zip(areas));
    pose
}

/// The bind pose rotated to a heading about +Y, with the hips at a point.
pub(crate) fn standing(skeleton: &Skeleton, heading: f64, hips_at: Point) -> Pose {
    let mut pose = Pose::bind(skeleton.len());
    pose.rotations[0] = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), heading);
    pose.translation = hips_at - skeleton.joints_in_bind[0];
    debug_assert!(Translation3::from(pose.translation).vector.iter().all(|x| x.is_finite()));
    pose
}

/// The most likely shape with the scan's stature, and the mean shape if that stature is unusual.
fn shapes_of_height(model: &BodyModel, surface: &ScanSurface) -> Vec<Shape> {
    let points = model.template.points();
    let by_height = |a: &(VertexId, &Point), b: &(VertexId, &Point)| a.1.y.total_cmp(&b.1.y);
    let (Some((top, p_top)), Some((bottom, p_bottom)), Some(bounds)) =
        (points.enumerate().max_by(by_height), points.enumerate().min_by(by_height), surface.mesh().bounds())
    else {
        return vec![model.mean_shape()];
    };
    let dirs: Vec<f64> = model.shape_dirs.iter().map(|d| d[top].y - d[bottom].y).collect();
    let deviation = dirs.iter().map(|d| d * d).sum::<f64>().sqrt();
    if deviation < 1e-6 {
        return vec![model.mean_shape()];
    }
    let unusual = (bounds.extent().y - (p_top.y - p_bottom.y)) / deviation;
    let clamped = unusual.clamp(-GREATEST_STATURE, GREATEST_STATURE);
    let mut shapes = vec![Shape(dirs.iter().map(|d| clamped * d / deviation).collect())];
    if unusual.abs() > USUAL_STATURE {
        shapes.push(model.mean_shape());
    }
    shapes
}
