//! Where a naked fit starts: several headings, statures and arms are tried, and scored.

use super::articulated::standing;
use super::naked::Stage;
use super::surface::{ScanSurface, area_centroid, lowest};
use super::thinned::Thinned;
use crate::body::{BodyModel, JointId, Pose, Shape};
use crate::geometry::{Point, Vec3, VertexId};
use nalgebra::UnitQuaternion;
use rayon::prelude::*;

/// Headings tried: a quarter of the basin of convergence seen on invented subjects (about ±50°).
const HEADINGS: usize = 8;
/// Headings that go on to the next round: front, back, and one more.
const KEPT: usize = 3;
/// Turns of an upper arm away from the bind pose, about the axis to the front, in degrees: hanging down, T-pose, and raised
/// in two steps. In between lies the basin of convergence (about 35°).
const ARM_TURNS_DEG: [f64; 4] = [-38.0, 42.0, 85.0, 125.0];
/// A stature further from the mean than this many deviations may be a raised arm or a seated person: the mean is tried too.
const USUAL_STATURE: f64 = 1.8;
/// And beyond this it is not believed.
const GREATEST_STATURE: f64 = 3.0;

/// A pose and a shape, with the score of how well they explain the scan, in metres: smaller is better.
#[derive(Clone)]
pub(crate) struct Start {
    pub(crate) pose: Pose,
    pub(crate) shape: Shape,
    pub(crate) score: f64,
    pub(crate) name: String,
}

/// Lays the limbs into the scan's.
const LIMBS: Stage =
    Stage { iterations: 6, samples: 0, reach: 0.25, least_cosine: 0.3, limbs_only: true, shape: false };

/// The best headings, best first. Rough ones are of half of the places, which do where there is nothing but a person.
pub(crate) fn headings(model: &BodyModel, surface: &ScanSurface, thinned: &Thinned, is_rough: bool) -> Vec<Start> {
    let limbs = Stage { samples: if is_rough { 500 } else { 0 }, ..LIMBS };
    let tries: Vec<(usize, Shape)> = shapes_of_height(model, surface)
        .into_iter()
        .flat_map(|shape| (0..HEADINGS).map(move |i| (i, shape.clone())))
        .collect();
    let mut found: Vec<(usize, Start)> = tries
        .into_par_iter()
        .map(|(i, shape)| {
            let heading_deg = i as f64 * 360.0 / HEADINGS as f64;
            let pose = placed(model, surface, thinned, &shape, heading_deg.to_radians());
            (i, fitted(thinned, &limbs, pose, shape, format!("heading {heading_deg:.0}°")))
        })
        .collect();
    found.sort_by(|a, b| a.1.score.total_cmp(&b.1.score));
    let mut kept: Vec<(usize, Start)> = Vec::new();
    for (i, start) in found {
        if kept.len() < KEPT && kept.iter().all(|k| k.0 != i) {
            kept.push((i, start));
        }
    }
    kept.into_iter().map(|k| k.1).collect()
}

/// Each fitted on, all joints and the shape.
pub(crate) fn with_arms_as_they_are(thinned: &Thinned, headings: &[Start]) -> Vec<Start> {
    headings.par_iter().map(|start| fitted_longer(thinned, start.clone())).collect()
}

/// The same from the best of other arms.
pub(crate) fn with_other_arms(model: &BodyModel, thinned: &Thinned, headings: Vec<Start>) -> Vec<Start> {
    headings
        .into_par_iter()
        .map(|start| fitted_longer(thinned, with_best_arms(model, thinned, &LIMBS, start)))
        .collect()
}

fn fitted_longer(thinned: &Thinned, start: Start) -> Start {
    let longer = Stage { iterations: 8, samples: 0, reach: 0.15, least_cosine: 0.3, limbs_only: false, shape: true };
    fitted(thinned, &longer, start.pose, start.shape, start.name)
}

fn fitted(thinned: &Thinned, stage: &Stage, pose: Pose, shape: Shape, name: String) -> Start {
    let (pose, shape) = thinned.fit(stage, pose, shape);
    Start { score: thinned.score(&pose, &shape), pose, shape, name }
}

/// Each arm is tried by itself; what is better on either side is put together.
fn with_best_arms(model: &BodyModel, thinned: &Thinned, stage: &Stage, start: Start) -> Start {
    let mut best = start.clone();
    for (side, sign) in [("left", 1.0), ("right", -1.0)] {
        let Some(arm) = model.skeleton.find_name(&format!("{side}UpperArm")) else { continue };
        let tries: Vec<Start> = ARM_TURNS_DEG
            .par_iter()
            .map(|deg| {
                let mut pose = best.pose.clone();
                for j in model.skeleton.ids().filter(|&j| model.skeleton.is_below(j, arm)) {
                    pose.rotations[j.index()] = UnitQuaternion::identity();
                }
                pose.rotations[arm.index()] = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), sign * deg.to_radians());
                let name = format!("{}, {side} arm {deg:+.0}°", best.name);
                fitted(thinned, stage, pose, best.shape.clone(), name)
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

/// Standing upright with that heading, where the scan stands.
fn placed(model: &BodyModel, surface: &ScanSurface, thinned: &Thinned, shape: &Shape, heading: f64) -> Pose {
    let skeleton = model.shaped(shape).1;
    let mut pose = standing(&skeleton, heading, skeleton.joints_in_bind[JointId(0).index()]);
    let (points, areas) = thinned.posed(&pose, shape);
    let mut shift = area_centroid(surface.mesh().points().iter().zip(surface.areas.iter()))
        - area_centroid(points.iter().zip(areas));
    shift.y = lowest(surface.mesh().points().iter()) - lowest(points.iter());
    pose.translation += shift;
    pose
}

/// The least unusual shape with the scan's stature, and the mean shape where that stature is unusual.
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
    let believed = unusual.clamp(-GREATEST_STATURE, GREATEST_STATURE);
    let mut shapes = vec![Shape(dirs.iter().map(|d| believed * d / deviation).collect())];
    if unusual.abs() > USUAL_STATURE {
        shapes.push(model.mean_shape());
    }
    shapes
}
