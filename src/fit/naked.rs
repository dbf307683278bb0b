//! The naked scan: Hu 2017, Eq. 4, by articulated ICP.

use super::articulated::{Articulated, PosePrior, Posed, Residual, standing};
use super::prior::{limbs_only, pose_stiffness};
use super::surface::{ScanSurface, spread};
use super::{FitError, FitReport, FittedBody, Step};
use crate::body::{BodyModel, Pose, Shape};
use crate::geometry::{Aabb, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId};
use crate::scan::Scan;
use nalgebra::UnitQuaternion;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How the naked scan is fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NakedParams {
    /// Places on the model and on the scan that take part in the last, finest iterations.
    pub samples: usize,
    /// Iterations of the finest stage at most.
    pub iterations: usize,
    /// Strength of the shape prior `|β|²` against residuals in units of 5 mm, one a 4 cm².
    pub shape_prior: f64,
    /// Strength of the pose prior on the same scale.
    pub pose_prior: f64,
    /// Greatest mean distance of the scan to the model, in metres, at which the result is taken for a body. A scan of
    /// a person in a coat fits a naked model to about 30 mm; chairs and dogs to more than 50.
    pub refuse_above: f64,
}

impl Default for NakedParams {
    fn default() -> Self {
        Self { samples: 6000, iterations: 30, shape_prior: 4.0, pose_prior: 20.0, refuse_above: 0.035 }
    }
}

/// One round of iterations with fixed gates.
struct Stage {
    iterations: usize,
    samples: usize,
    /// Correspondences further apart are ignored; metres.
    reach: f64,
    /// Normals at a greater angle do not match.
    least_cosine: f64,
    /// Only root, shoulders, hips and knees turn.
    limbs_only: bool,
    shape: bool,
}

/// Residual scale: about the noise of a depth camera at 2 m, and what a 15-component model leaves. Metres.
const SIGMA: f64 = 0.005;
/// Area that counts as one observation. Square metres.
const AREA_PER_OBSERVATION: f64 = 4e-4;
/// Headings tried: a quarter of the basin of convergence seen on invented subjects (about ±50°).
const HEADINGS: usize = 8;
/// Arm spreads tried, away from the bind pose, in degrees.
const ARM_SPREADS_DEG: [f64; 3] = [-28.0, 0.0, 28.0];

/// Fits shape and pose to a scan of the naked body, whatever its heading.
///
/// **Frame** the result's pose is in the scan's world frame.
///
/// **Errors** [`FitError::NotABody`] where no start leads to a body that explains the scan.
pub fn fit_naked(
    scan: &Scan,
    model: &BodyModel,
    params: &NakedParams,
    on_step: &mut dyn FnMut(&Step),
) -> Result<FittedBody, FitError> {
    let surface = ScanSurface::prepare(&scan.mesh);
    let bounds = scan.mesh.bounds().ok_or(FitError::EmptyScan)?;
    let solver = Solver { body: Articulated::of_model(model), model, surface: &surface, params };
    let mut log = Vec::new();

    let shape = shape_of_height(model, bounds.extent().y);
    let best = solver.best_start(&bounds, &shape, &mut log);
    let (pose, shape, iterations, converged) = solver.refine(best.pose, best.shape, on_step);

    let posed = solver.body.posed(&pose, &shape);
    let (residual_mean, residual_p95) = solver.residual(&posed);
    let (mesh, skeleton) = model.shaped(&shape);
    if residual_mean > params.refuse_above {
        return Err(FitError::NotABody { residual_mm: residual_mean * 1e3, limit_mm: params.refuse_above * 1e3 });
    }
    let report = FitReport { converged, iterations, residual_mean, residual_p95, log, ..FitReport::default() };
    Ok(FittedBody { shape, pose, surface: mesh, skeleton, report })
}

/// The least unusual shape with that stature.
fn shape_of_height(model: &BodyModel, height: f64) -> Shape {
    let points = model.template.points();
    let by_height = |a: &(VertexId, &Point), b: &(VertexId, &Point)| a.1.y.total_cmp(&b.1.y);
    let (Some((top, p_top)), Some((bottom, p_bottom))) =
        (points.enumerate().max_by(by_height), points.enumerate().min_by(by_height))
    else {
        return model.mean_shape();
    };
    let dirs: Vec<f64> = model.shape_dirs.iter().map(|d| d[top].y - d[bottom].y).collect();
    let square: f64 = dirs.iter().map(|d| d * d).sum();
    let lack = height - (p_top.y - p_bottom.y);
    Shape(dirs.iter().map(|d| if square > 1e-12 { lack * d / square } else { 0.0 }).collect())
}

struct Start {
    pose: Pose,
    shape: Shape,
    score: f64,
    name: String,
}

struct Solver<'a> {
    body: Articulated<'a>,
    model: &'a BodyModel,
    surface: &'a ScanSurface,
    params: &'a NakedParams,
}

impl Solver<'_> {
    /// Short fits from several headings, then from several arm spreads at the best two; the best by score.
    fn best_start(&self, bounds: &Aabb, shape: &Shape, log: &mut Vec<String>) -> Start {
        let quick =
            Stage { iterations: 6, samples: 700, reach: 0.25, least_cosine: 0.3, limbs_only: true, shape: false };
        let run = |heading_deg: f64, spread_deg: f64| {
            let start = self.start(bounds, shape, heading_deg, spread_deg);
            let (pose, shape, _) = self.run(&quick, start, shape.clone(), &mut |_, _| {});
            let score = self.score(&pose, &shape);
            Start { pose, shape, score, name: format!("heading {heading_deg:.0}°, arms {spread_deg:+.0}°") }
        };
        let mut by_heading: Vec<(f64, Start)> = (0..HEADINGS)
            .into_par_iter()
            .map(|i| i as f64 * 360.0 / HEADINGS as f64)
            .map(|h| (h, run(h, 0.0)))
            .collect();
        by_heading.sort_by(|a, b| a.1.score.total_cmp(&b.1.score));
        let tries: Vec<(f64, f64)> = by_heading
            .iter()
            .take(3)
            .flat_map(|(h, _)| ARM_SPREADS_DEG.iter().filter(|s| **s != 0.0).map(|s| (*h, *s)))
            .collect();
        let mut all: Vec<Start> = tries.into_par_iter().map(|(h, s)| run(h, s)).collect();
        all.extend(by_heading.into_iter().take(3).map(|(_, start)| start));
        all.sort_by(|a, b| a.score.total_cmp(&b.score));

        // The leaders are told apart by a longer fit with shape: front from back shows only in feet and face.
        let longer =
            Stage { iterations: 8, samples: 1500, reach: 0.12, least_cosine: 0.4, limbs_only: false, shape: true };
        let mut finals: Vec<Start> = all
            .into_par_iter()
            .take(4)
            .map(|s| {
                let (pose, shape, _) = self.run(&longer, s.pose, s.shape, &mut |_, _| {});
                let score = self.score(&pose, &shape);
                Start { pose, shape, score, name: s.name }
            })
            .collect();
        finals.sort_by(|a, b| a.score.total_cmp(&b.score));
        for s in &finals {
            log.push(format!("start at {}: score {:.1} mm", s.name, s.score * 1e3));
        }
        finals.swap_remove(0)
    }

    fn start(&self, bounds: &Aabb, shape: &Shape, heading_deg: f64, spread_deg: f64) -> Pose {
        let (mesh, skeleton) = self.model.shaped(shape);
        let mut pose = standing(&skeleton, heading_deg.to_radians(), skeleton.joints_in_bind[0]);
        for (name, sign) in [("leftUpperArm", 1.0), ("rightUpperArm", -1.0)] {
            if let Some(j) = skeleton.find(name) {
                pose.rotations[j.index()] =
                    UnitQuaternion::from_axis_angle(&Vec3::z_axis(), sign * spread_deg.to_radians());
            }
        }
        let posed = self.body.posed(&pose, shape);
        let center = |points: &PerVertex<Point>, areas: &PerVertex<f64>| {
            let total: f64 = areas.iter().sum();
            points.iter().zip(areas.iter()).map(|(p, a)| p.coords * *a).sum::<Vec3>() / total.max(1e-12)
        };
        let model_center = center(&posed.points, &mesh.vertex_areas());
        let scan_center = center(self.surface.mesh().points(), &self.surface.areas);
        let floor = posed.points.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
        pose.translation += scan_center - model_center;
        pose.translation.y += bounds.min.y - floor - (scan_center - model_center).y;
        pose
    }

    fn refine(&self, pose: Pose, shape: Shape, on_step: &mut dyn FnMut(&Step)) -> (Pose, Shape, usize, bool) {
        let n = self.params.samples;
        let stages = [
            Stage { iterations: 6, samples: n / 3, reach: 0.10, least_cosine: 0.4, limbs_only: false, shape: true },
            Stage { iterations: 6, samples: n / 2, reach: 0.06, least_cosine: 0.5, limbs_only: false, shape: true },
            Stage {
                iterations: self.params.iterations,
                samples: n,
                reach: 0.035,
                least_cosine: 0.6,
                limbs_only: false,
                shape: true,
            },
        ];
        let (mut pose, mut shape) = (pose, shape);
        let (mut iterations, mut converged) = (0, false);
        for stage in &stages {
            let before = iterations;
            let (p, s, done) = self.run(stage, pose, shape, &mut |i, moved| {
                iterations = before + i + 1;
                on_step(&Step { iteration: before + i + 1, moved });
            });
            (pose, shape, converged) = (p, s, done);
        }
        (pose, shape, iterations, converged)
    }

    /// Runs a stage; returns whether it ended because steps had become small.
    fn run(
        &self,
        stage: &Stage,
        pose: Pose,
        shape: Shape,
        on_iteration: &mut dyn FnMut(usize, f64),
    ) -> (Pose, Shape, bool) {
        /// A joint moved less than this in a step, in metres: far below the scan's noise.
        const STILL: f64 = 2e-4;
        let (mut pose, mut shape) = (pose, shape);
        let areas = self.model.template.vertex_areas();
        let model_samples = spread(&areas, stage.samples);
        let scan_samples = self.surface.samples(stage.samples);
        let stiffness = pose_stiffness(&self.body.skeleton, self.params.pose_prior);
        let frozen = self.frozen(stage);
        let mut still = 0;
        for iteration in 0..stage.iterations {
            let posed = self.body.posed(&pose, &shape);
            let mut residuals = self.model_to_scan(&posed, stage, &model_samples);
            residuals.extend(self.scan_to_model(&posed, stage, &scan_samples));
            let mut equations = self.body.normal_equations(&posed, &residuals);
            let center = Pose::bind(self.body.joint_count());
            let prior =
                PosePrior { center: &center, stiffness: &stiffness, limits: &self.model.limits, limit_stiffness: 2e4 };
            equations.add_pose_prior(&posed, &pose, &prior);
            equations.add_shape_prior(&shape, self.params.shape_prior);
            equations.freeze(frozen.iter().copied());
            let Some(delta) = equations.solve(1e-4) else { break };
            let (p, s) = self.body.stepped(&posed, &pose, &shape, &delta);
            let moved = self.moved(&posed, &p, &s);
            (pose, shape) = (p, s);
            on_iteration(iteration, moved);
            still = if moved < STILL { still + 1 } else { 0 };
            if still >= 2 {
                return (pose, shape, true);
            }
        }
        (pose, shape, still > 0)
    }

    fn frozen(&self, stage: &Stage) -> Vec<usize> {
        let joint_count = self.body.joint_count();
        let mut frozen = Vec::new();
        if stage.limbs_only {
            let free = limbs_only(&self.body.skeleton);
            frozen.extend((0..joint_count).filter(|j| !free[*j]).flat_map(|j| 3 + 3 * j..6 + 3 * j));
        }
        if !stage.shape {
            frozen.extend(3 + 3 * joint_count..self.body.unknown_count());
        }
        frozen
    }

    fn moved(&self, posed: &Posed, pose: &Pose, shape: &Shape) -> f64 {
        let after = self.model.shaped(shape).1.joints_in_world(pose);
        posed.joints_in_world.iter().zip(&after).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }

    fn model_to_scan(&self, posed: &Posed, stage: &Stage, samples: &[(VertexId, f64)]) -> Vec<Residual> {
        let normals = self.model.template.with_points(posed.points.clone()).vertex_normals();
        samples
            .par_iter()
            .filter_map(|&(v, area)| {
                let p = posed.points[v];
                let hit = self.surface.nearest(&p, stage.reach)?;
                if hit.at_rim || hit.normal.dot(&normals[v]) < stage.least_cosine {
                    return None;
                }
                let gap = hit.normal.dot(&(hit.point - p));
                Some(Residual::on_vertex(v, hit.normal, gap, robust(area, hit.distance, stage.reach)))
            })
            .collect()
    }

    fn scan_to_model(&self, posed: &Posed, stage: &Stage, samples: &[(VertexId, f64)]) -> Vec<Residual> {
        let mesh = self.model.template.with_points(posed.points.clone());
        let normals = mesh.vertex_normals();
        let index = SurfaceIndex::prepare(&mesh);
        samples
            .par_iter()
            .filter_map(|&(v, area)| {
                let q = self.surface.mesh().points()[v];
                let normal = self.surface.normals[v];
                let s = index.closest_within(&q, stage.reach)?;
                let corners = mesh.faces()[s.face];
                let on_model: Vec3 = (0..3).map(|k| normals[corners[k]] * s.barycentric[k]).sum();
                if on_model.dot(&normal) < stage.least_cosine {
                    return None;
                }
                let at = std::array::from_fn(|k| (corners[k], s.barycentric[k]));
                let gap = normal.dot(&(q - s.point));
                Some(Residual { at, normal, gap, weight: robust(area, s.distance, stage.reach) })
            })
            .collect()
    }

    /// Mean truncated distance both ways: comparable between starts whatever they have matched.
    fn score(&self, pose: &Pose, shape: &Shape) -> f64 {
        /// Truncation: an arm that points elsewhere counts as this far. Metres.
        const TRUNCATE: f64 = 0.15;
        let posed = self.body.posed(pose, shape);
        let mesh = self.model.template.with_points(posed.points);
        let there = mean_distance(&self.surface.index, &mesh, &mesh.vertex_areas(), TRUNCATE);
        let back = mean_distance(&SurfaceIndex::prepare(&mesh), self.surface.mesh(), &self.surface.areas, TRUNCATE);
        0.5 * (there + back)
    }

    fn residual(&self, posed: &Posed) -> (f64, f64) {
        let index = SurfaceIndex::prepare(&self.model.template.with_points(posed.points.clone()));
        let mut distances: Vec<f64> = self
            .surface
            .samples(self.params.samples)
            .par_iter()
            .map(|&(v, _)| index.closest(&self.surface.mesh().points()[v]).distance)
            .collect();
        distances.sort_by(f64::total_cmp);
        let count = distances.len().max(1);
        let p95 = distances.get(count * 95 / 100).copied().unwrap_or(0.0);
        (distances.iter().sum::<f64>() / count as f64, p95)
    }
}

fn mean_distance(to: &SurfaceIndex, from: &TriMesh, areas: &PerVertex<f64>, truncate: f64) -> f64 {
    /// Enough for a mean to 1 %.
    const SAMPLES: usize = 1500;
    let samples = spread(areas, SAMPLES);
    let distances: Vec<(f64, f64)> = samples
        .iter()
        .map(|&(v, a)| (a, to.closest_within(&from.points()[v], truncate).map_or(truncate, |s| s.distance)))
        .collect();
    let total: f64 = distances.iter().map(|d| d.0).sum();
    distances.iter().map(|d| d.0 * d.1).sum::<f64>() / total.max(1e-12)
}

/// Area over the area of one observation, over σ², under a Geman–McClure kernel that ends near `reach`.
pub(crate) fn robust(area: f64, distance: f64, reach: f64) -> f64 {
    let scale = 0.4 * reach;
    let kernel = 1.0 / (1.0 + (distance / scale).powi(2)).powi(2);
    area / AREA_PER_OBSERVATION / (SIGMA * SIGMA) * kernel
}
