//! Aligns one frame with the prediction: point-to-plane ICP with projective association.

use super::camera::depth_noise;
use super::raycast::{PredictedPoint, Prediction};
use super::view::{Level, PersonFrame};
use nalgebra::{Isometry3, Matrix6, Point3, Translation3, UnitQuaternion, Vector3, Vector6};
use rayon::prelude::*;

/// Points per task: the sums of tasks are added in order, so the number of threads does not matter.
const CHUNK: usize = 1024;
/// Least cosine between the normals of partners: 50°.
const SAME_SIDE: f32 = 0.64;
/// Tukey's constant: 95 % efficient on clean data.
const TUKEY: f64 = 4.685;

/// How points find their partners.
#[derive(Clone, Copy, Debug)]
pub(super) struct IcpPass {
    /// 0 is half size, 1 is quarter size.
    pub(super) level: usize,
    pub(super) iterations: usize,
    /// Greatest distance of partners, in metres.
    pub(super) gate: f32,
}

/// From far to near, for a new frame.
pub(super) const TRACKING: [IcpPass; 3] = [
    IcpPass { level: 1, iterations: 6, gate: 0.10 },
    IcpPass { level: 1, iterations: 4, gate: 0.05 },
    IcpPass { level: 0, iterations: 5, gate: 0.03 },
];
/// For a frame whose pose is nearly known.
pub(super) const SETTLING: [IcpPass; 1] = [IcpPass { level: 0, iterations: 4, gate: 0.03 }];

/// The pose found for a frame.
#[derive(Clone, Debug)]
pub(super) struct Alignment {
    pub(super) model_from_camera: Isometry3<f64>,
    /// Robust standard deviation of the distances to the surface, metres.
    pub(super) residual: f64,
    /// Share of the frame's points that have a partner and agree with it.
    pub(super) overlap: f64,
    /// The mean of its points, in the model's frame.
    pub(super) center: Point3<f64>,
}

#[derive(Clone)]
struct IcpSums {
    matrix: Matrix6<f64>,
    vector: Vector6<f64>,
    agreeing: usize,
}

/// Finds the pose that puts a view's points on the predicted surface, from a guess.
pub(super) fn align(
    view: &PersonFrame,
    prediction: &Prediction,
    guess: &Isometry3<f64>,
    stages: &[IcpPass],
) -> Alignment {
    let mut pose = *guess;
    let mut result =
        Alignment { model_from_camera: pose, residual: f64::INFINITY, overlap: 0.0, center: Point3::origin() };
    for stage in stages {
        let level = &view.levels[stage.level];
        if level.points.is_empty() {
            return result;
        }
        let mut scale = f64::from(stage.gate) / TUKEY;
        for iteration in 0..=stage.iterations {
            let pairs = pairs(level, prediction, &pose, stage.gate);
            let residuals: Vec<f32> = pairs.iter().flatten().map(|p| p.residual).collect();
            if residuals.len() < 30 {
                result.overlap = 0.0;
                return result;
            }
            scale = robust_scale(residuals, level).min(scale.max(0.003));
            let center = pose * middle(level);
            let sums = summed(&pairs, &center, TUKEY * scale);
            result = Alignment {
                model_from_camera: pose,
                residual: scale,
                overlap: sums.agreeing as f64 / level.points.len() as f64,
                center,
            };
            if iteration == stage.iterations {
                break;
            }
            // A small damping for directions that the surface does not constrain.
            let stiff = 1e-6 * sums.matrix.trace() / 6.0;
            let Some(factor) = (sums.matrix + Matrix6::identity() * stiff).cholesky() else { break };
            let step = -factor.solve(&sums.vector);
            pose = moved(&pose, &step, &center);
            let (turned, shifted) = (step.fixed_rows::<3>(0).norm(), step.fixed_rows::<3>(3).norm());
            // 0.002° and 10 µm: a hundredth of the required accuracy.
            if turned < 4e-5 && shifted < 1e-5 && iteration + 1 < stage.iterations {
                break;
            }
        }
    }
    result
}

/// A pose moved by a small rotation about `center` and a translation, both in the model's frame.
pub(super) fn moved(pose: &Isometry3<f64>, step: &Vector6<f64>, center: &Point3<f64>) -> Isometry3<f64> {
    let rotation = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
    let shift = center.coords - rotation * center.coords + step.fixed_rows::<3>(3);
    Isometry3::from_parts(Translation3::from(shift), rotation) * pose
}

/// Mean squared distance of a view's points from the predicted surface, each at most `gate`; those without a partner
/// count as `gate`. In units of `gate` squared: 0 is a perfect match, 1 means that no point matches.
pub(super) fn misfit(view: &PersonFrame, prediction: &Prediction, pose: &Isometry3<f64>, gate: f32) -> f64 {
    let level = &view.levels[1];
    let pairs = pairs(level, prediction, pose, gate);
    let cost: f64 =
        pairs.iter().map(|p| p.as_ref().map_or(1.0, |p| f64::from((p.residual / gate).powi(2)).min(1.0))).sum();
    cost / pairs.len().max(1) as f64
}

struct Pair {
    point: Vector3<f32>,
    normal: Vector3<f32>,
    residual: f32,
    weight: f32,
}

fn pairs(level: &Level, prediction: &Prediction, pose: &Isometry3<f64>, gate: f32) -> Vec<Option<Pair>> {
    let model_from_camera = pose.cast::<f32>();
    let camera_from_model = prediction.camera_from_model.cast::<f32>();
    let camera = &prediction.camera;
    let (fx, fy, cx, cy) = (camera.fx as f32, camera.fy as f32, camera.cx as f32 + 0.5, camera.cy as f32 + 0.5);
    let (w, h) = (camera.width as f32, camera.height as f32);
    let partner = |i: usize| {
        let (p, n) = (&level.points[i], &level.normals[i]);
        let m = model_from_camera * p;
        let c = camera_from_model * m;
        let (u, v) = (fx * c.x / c.z + cx, fy * c.y / c.z + cy);
        if !(c.z > 0.0 && u >= 0.0 && v >= 0.0 && u < w && v < h) {
            return None;
        }
        let at = v as usize * camera.width + u as usize;
        let PredictedPoint { point, normal } = prediction.seen[at];
        let apart = m - point;
        let same_side = (model_from_camera.rotation * n).dot(&normal) > SAME_SIDE;
        if !same_side || apart.norm_squared() > gate * gate {
            return None;
        }
        let slope = -n.dot(&p.coords) / p.coords.norm();
        Some(Pair { point: m.coords, normal, residual: normal.dot(&apart), weight: slope.max(0.0) })
    };
    (0..level.points.len()).into_par_iter().with_min_len(CHUNK).map(partner).collect()
}

fn robust_scale(mut residuals: Vec<f32>, level: &Level) -> f64 {
    for r in &mut residuals {
        *r = r.abs();
    }
    let middle = residuals.len() / 2;
    let (_, median, _) = residuals.select_nth_unstable_by(middle, f32::total_cmp);
    // Smoothing leaves a fifth of the noise; a lower estimate is chance.
    let expected = 0.2 * depth_noise(f64::from(level.points[level.points.len() / 2].z));
    (1.4826 * f64::from(*median)).max(expected)
}

fn middle(level: &Level) -> Point3<f64> {
    let sum: Vector3<f64> = level.points.iter().map(|p| p.coords.cast::<f64>()).sum();
    Point3::from(sum / level.points.len() as f64)
}

fn summed(pairs: &[Option<Pair>], center: &Point3<f64>, cutoff: f64) -> IcpSums {
    let zero = || IcpSums { matrix: Matrix6::zeros(), vector: Vector6::zeros(), agreeing: 0 };
    let parts: Vec<IcpSums> = pairs
        .par_chunks(CHUNK)
        .map(|chunk| {
            let mut sums = zero();
            for pair in chunk.iter().flatten() {
                let r = f64::from(pair.residual);
                let share = 1.0 - (r / cutoff).powi(2);
                if share <= 0.0 {
                    continue;
                }
                sums.agreeing += 1;
                let weight = share * share * f64::from(pair.weight);
                let normal = pair.normal.cast::<f64>();
                let arm = (pair.point.cast::<f64>() - center.coords).cross(&normal);
                let row = Vector6::new(arm.x, arm.y, arm.z, normal.x, normal.y, normal.z);
                sums.matrix.ger(weight, &row, &row, 1.0);
                sums.vector.axpy(weight * r, &row, 1.0);
            }
            sums
        })
        .collect();
    parts.into_iter().fold(zero(), |mut all, part| {
        all.matrix += part.matrix;
        all.vector += part.vector;
        all.agreeing += part.agreeing;
        all
    })
}
