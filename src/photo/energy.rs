//! What a solution minimises: the terms of Bogo 2016, each squared and in units of its standard deviation, so that half of the
//! sum is a negative log posterior.

use super::anchor::{Anchor, Posed, Rig};
use super::camera::PhotoCamera;
use super::capsules::Capsules;
use super::mark::Mark;
use super::prior::{PosePrior, hinges, vector_from_turn};
use crate::body::{JointId, Pose};
use crate::geometry::Vec3;
use nalgebra::{DMatrix, DVector, Vector2};

/// A keypoint with its place on the body.
pub(super) struct Sighting {
    pub mark: Mark,
    pub anchor: Anchor,
    pub at: Vector2<f64>,
    pub confidence: f64,
    /// Its standard deviation in pixels.
    pub sigma: f64,
}

/// Everything that the energy of a pose and shape depends on.
pub(super) struct Energy<'a> {
    pub rig: Rig<'a>,
    pub camera: &'a PhotoCamera,
    pub sightings: Vec<Sighting>,
    pub prior: PosePrior,
    pub capsules: Capsules,
    /// Points of both soles, where the camera's pose makes y = 0 the floor.
    pub soles: Vec<Anchor>,
    /// The stature that was given, and the stature of a shape: at the mean and per coordinate.
    pub height: Option<f64>,
    pub stature: (f64, Vec<f64>),
}

/// What one solve may move, and how much the priors count.
#[derive(Clone, Copy)]
pub(super) struct Stage {
    /// Only the translation and the turn of the whole body, from torso and head alone.
    pub only_root: bool,
    /// Factor of the pose's and the shape's prior.
    pub priors: f64,
    /// Distance in standard deviations at which a keypoint counts a quarter (Geman–McClure).
    pub outlier: f64,
}

/// The last stage: the posterior itself.
pub(super) const LAST: Stage = Stage { only_root: false, priors: 1.0, outlier: OUTLIER };

/// The last stage's distance: beyond it the tracker erred.
const OUTLIER: f64 = 5.0;
/// Standard deviation beyond a joint limit, in radians: 2°, as for trackers in `drive`.
const BEYOND_LIMIT: f64 = 0.035;
/// The bending prior (Bogo 2016 §3.1): weight, and rate per radian. Straight costs 0.1, 10° backwards 0.5, 40° flexed nothing.
const BEND: [f64; 2] = [0.3, 5.0];
/// Standard deviation of interpenetration beyond what flesh gives way, in metres.
const OVERLAP: f64 = 0.015;
/// Standard deviation of the lowest sole above the floor, and of any sole below it, in metres.
const FLOOR: f64 = 0.01;
/// Standard deviation of the given height, in metres.
const HEIGHT: f64 = 0.005;
/// Standard deviation of the trunk's tilt, as the sine of its angle with the vertical: people stand in photos.
const TILT: f64 = 0.35;

/// The normal equations of the energy at one place.
pub(super) struct Equations {
    pub matrix: DMatrix<f64>,
    pub gradient: DVector<f64>,
    pub cost: f64,
}

impl Equations {
    fn new(unknowns: usize) -> Self {
        Self { matrix: DMatrix::zeros(unknowns, unknowns), gradient: DVector::zeros(unknowns), cost: 0.0 }
    }

    /// Adds a residual with its derivative, of which the cost is added apart (it may be robust).
    fn add(&mut self, residual: f64, weight: f64, row: &[f64]) {
        for (i, &a) in row.iter().enumerate().filter(|(_, a)| **a != 0.0) {
            self.gradient[i] += weight * a * residual;
            for (j, &b) in row.iter().enumerate().take(i + 1) {
                self.matrix[(i, j)] += weight * a * b;
            }
        }
    }

    fn add_squared(&mut self, residual: f64, row: &[f64]) {
        self.cost += residual * residual;
        self.add(residual, 1.0, row);
    }
}

impl Energy<'_> {
    /// The energy and its normal equations.
    pub fn equations(&self, pose: &Pose, shape: &[f64], stage: Stage) -> Equations {
        let posed = self.rig.posed(pose, shape);
        let mut equations = Equations::new(self.rig.unknowns());
        self.add_sightings(&mut equations, &posed, shape, stage);
        self.add_tilt(&mut equations, &posed);
        if !self.soles.is_empty() {
            self.add_floor(&mut equations, &posed, shape);
        }
        self.add_shape(&mut equations, shape, stage);
        if !stage.only_root {
            self.add_joints(&mut equations, pose, stage);
            self.add_overlaps(&mut equations, &posed, shape);
        }
        equations.matrix.fill_upper_triangle_with_lower_triangle();
        equations
    }

    fn add_sightings(&self, equations: &mut Equations, posed: &Posed, shape: &[f64], stage: Stage) {
        let mut columns = vec![Vec3::zeros(); self.rig.unknowns()];
        let mut rows = [vec![0.0; columns.len()], vec![0.0; columns.len()]];
        for sighting in
            self.sightings.iter().filter(|s| !stage.only_root || s.mark.is_of_torso() || s.mark.is_of_head())
        {
            let p = self.rig.place_and_derivative(posed, shape, &sighting.anchor, &mut columns);
            let Some(pixel) = self.camera.project(&p) else {
                // Behind the camera there is no slope back: the step is refused.
                equations.cost = f64::INFINITY;
                return;
            };
            let sigma = sighting.sigma;
            let gap = (pixel - sighting.at) / sigma;
            let ratio = gap.norm_squared() / (stage.outlier * stage.outlier);
            equations.cost += sighting.confidence * gap.norm_squared() / (1.0 + ratio);
            let weight = sighting.confidence / ((1.0 + ratio) * (1.0 + ratio));
            let slope = self.camera.derivative(&p) / sigma;
            for (i, row) in rows.iter_mut().enumerate() {
                for (entry, column) in row.iter_mut().zip(&columns) {
                    *entry = slope.row(i).transpose().dot(column);
                }
                equations.add(gap[i], weight, row);
            }
        }
    }

    fn add_tilt(&self, equations: &mut Equations, posed: &Posed) {
        let mut row = vec![0.0; self.rig.unknowns()];
        // The root's anatomical axes are those of the bind pose.
        let up = posed.axes[0][1];
        for i in [0, 2] {
            for (k, axis) in posed.axes[0].iter().enumerate() {
                row[3 + k] = axis.cross(&up)[i] / TILT;
            }
            equations.add_squared(up[i] / TILT, &row);
        }
    }

    fn add_floor(&self, equations: &mut Equations, posed: &Posed, shape: &[f64]) {
        let mut columns = vec![Vec3::zeros(); self.rig.unknowns()];
        let heights: Vec<f64> = self.soles.iter().map(|sole| self.rig.place(posed, shape, sole).y).collect();
        let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
        for (sole, &height) in self.soles.iter().zip(&heights) {
            if height < 0.0 || height == lowest {
                self.rig.place_and_derivative(posed, shape, sole, &mut columns);
                let row: Vec<f64> = columns.iter().map(|c| c.y / FLOOR).collect();
                equations.add_squared(height / FLOOR, &row);
            }
        }
    }

    fn add_shape(&self, equations: &mut Equations, shape: &[f64], stage: Stage) {
        let at = self.rig.shape_at();
        let factor = stage.priors.sqrt();
        for (k, beta) in shape.iter().enumerate() {
            let mut row = vec![0.0; self.rig.unknowns()];
            row[at + k] = factor;
            equations.add_squared(factor * beta, &row);
        }
        if let Some(height) = self.height {
            let (mean, per_beta) = &self.stature;
            let stature = per_beta.iter().zip(shape).fold(*mean, |sum, (d, beta)| sum + d * beta);
            let mut row = vec![0.0; self.rig.unknowns()];
            row[at..].iter_mut().zip(per_beta).for_each(|(entry, d)| *entry = d / HEIGHT);
            equations.add_squared((stature - height) / HEIGHT, &row);
        }
    }

    /// The prior of each joint, its limits, and the bending prior of the hinges.
    fn add_joints(&self, equations: &mut Equations, pose: &Pose, stage: Stage) {
        let skeleton = &self.rig.model.skeleton;
        let joints = self.rig.turning.iter().enumerate().filter(|(_, j)| **j != 0);
        for ((t, &j), (mean, root)) in joints.zip(&self.prior.joints) {
            let joint = JointId(j as u16);
            let vector = self.rig.anatomy.rotation(pose, joint).scaled_axis();
            let derivative = vector_from_turn(&vector);
            let mut row = vec![0.0; self.rig.unknowns()];
            let factor = stage.priors.sqrt();
            let residual = root * (vector - mean) * factor;
            let slope = root * derivative * factor;
            for i in 0..3 {
                row[3 + 3 * t..6 + 3 * t].copy_from_slice(slope.row(i).transpose().as_slice());
                equations.add_squared(residual[i], &row);
            }
            if let Some(within) = self.rig.anatomy.limited_joint(pose, joint) {
                let mut inside = pose.clone();
                inside.rotations[j] = within;
                let limit = self.rig.anatomy.rotation(&inside, joint);
                let beyond = (limit.inverse() * self.rig.anatomy.rotation(pose, joint)).scaled_axis();
                // The limits resist only further in the direction in which they are exceeded.
                if let Some(direction) = beyond.try_normalize(1e-12) {
                    row[3 + 3 * t..6 + 3 * t].copy_from_slice((direction / BEYOND_LIMIT).as_slice());
                    equations.add_squared(beyond.norm() / BEYOND_LIMIT, &row);
                }
            }
            let hinge = hinges().into_iter().find(|(human, _)| skeleton.human_joint(joint) == Some(*human));
            if let Some((_, sign)) = hinge {
                let [weight, rate] = BEND;
                let residual = weight * (-rate * sign * vector.x).min(4.0).exp();
                let slope = derivative.row(0) * (-rate * sign * residual);
                row[3 + 3 * t..6 + 3 * t].copy_from_slice(slope.transpose().as_slice());
                equations.add_squared(residual, &row);
            }
        }
    }

    fn add_overlaps(&self, equations: &mut Equations, posed: &Posed, shape: &[f64]) {
        let mut columns = [vec![Vec3::zeros(); self.rig.unknowns()], vec![Vec3::zeros(); self.rig.unknowns()]];
        for overlap in self.capsules.overlaps(&self.rig, posed, shape) {
            for (anchor, columns) in overlap.at.iter().zip(&mut columns) {
                self.rig.place_and_derivative(posed, shape, anchor, columns);
            }
            let [first, second] = &columns;
            let row: Vec<f64> =
                first.iter().zip(second).map(|(a, b)| -overlap.normal.dot(&(a - b)) / OVERLAP).collect();
            equations.add_squared(overlap.depth / OVERLAP, &row);
        }
    }

    /// Mean distance in pixels of the keypoints from their projections, without outliers, and how many outliers there are.
    pub fn distance(&self, pose: &Pose, shape: &[f64]) -> (f64, usize) {
        let posed = self.rig.posed(pose, shape);
        let gaps = self.sightings.iter().map(|sighting| {
            let p = self.rig.place(&posed, shape, &sighting.anchor);
            let gap = self.camera.project(&p).map_or(f64::INFINITY, |pixel| (pixel - sighting.at).norm());
            (gap, sighting.sigma)
        });
        let near: Vec<f64> = gaps.filter(|(gap, sigma)| *gap < OUTLIER * sigma).map(|(gap, _)| gap).collect();
        (near.iter().sum::<f64>() / near.len() as f64, self.sightings.len() - near.len())
    }
}
