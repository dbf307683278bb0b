//! The normal equations of a Gauss–Newton step, summed by the parts that a residual touches: its chain of joints and the
//! shape, a seventh of the whole.

use super::articulated::Posed;
use crate::body::{JointLimits, Pose, Shape};
use crate::geometry::Vec3;
use nalgebra::{DMatrix, DVector, Matrix3, UnitQuaternion};

/// What a step may change besides the translation.
#[derive(Clone, Debug)]
pub(crate) struct Unknowns {
    /// Joints that may turn.
    pub(crate) joints: Vec<bool>,
    /// Whether the shape may change.
    pub(crate) shape: bool,
}

impl Unknowns {
    /// Columns that a step leaves as they are.
    fn held(&self, columns: usize) -> impl Iterator<Item = usize> + '_ {
        let first = 3 + 3 * self.joints.len();
        let joints = (0..self.joints.len()).filter(|j| !self.joints[*j]).flat_map(|j| 3 + 3 * j..6 + 3 * j);
        joints.chain((first..columns).filter(|_| !self.shape))
    }
}

/// `½ δᵀHδ − gᵀδ`.
pub(crate) struct NormalEquations {
    pub(crate) h: DMatrix<f64>,
    pub(crate) g: DVector<f64>,
}

/// The derivative of one residual.
#[derive(Default)]
pub(super) struct JacobianRow {
    /// By the translation.
    pub(super) shift: Vec3,
    /// By the turn of each joint above it, in ascending order.
    pub(super) turns: Vec<(usize, Vec3)>,
    /// By the shape.
    pub(super) shape: Vec<f64>,
    /// For each of these joints Σ w (G v) and Σ w over what hangs below it.
    pub(super) arms: Vec<(usize, Vec3, f64)>,
}

impl JacobianRow {
    /// Back to nothing, for so many components.
    pub(super) fn clear(&mut self, components: usize) {
        self.shift = Vec3::zeros();
        self.turns.clear();
        self.arms.clear();
        self.shape.clear();
        self.shape.resize(components, 0.0);
    }

    /// What moves with a joint.
    pub(super) fn hang(&mut self, joint: usize, arm: &Vec3, weight: f64) {
        match self.arms.iter_mut().find(|(j, _, _)| *j == joint) {
            Some((_, sum, total)) => {
                *sum += arm;
                *total += weight;
            }
            None => self.arms.push((joint, *arm, weight)),
        }
    }
}

/// The upper half of `H`, in blocks: block 0 is the translation, block `1 + j` the turn of joint `j`.
pub(super) struct Sums {
    joints: usize,
    components: usize,
    /// (1 + J)² blocks; those below the diagonal stay zero.
    turns: Vec<Matrix3<f64>>,
    /// (1 + J) × 3 × K.
    turns_by_shape: Vec<f64>,
    /// K × K, a row after the other; upper half.
    shape: Vec<f64>,
    g: DVector<f64>,
}

impl Sums {
    pub(super) fn zero(joints: usize, components: usize) -> Self {
        let blocks = 1 + joints;
        Self {
            joints,
            components,
            turns: vec![Matrix3::zeros(); blocks * blocks],
            turns_by_shape: vec![0.0; blocks * 3 * components],
            shape: vec![0.0; components * components],
            g: DVector::zeros(3 * blocks + components),
        }
    }

    pub(super) fn add(&mut self, row: &JacobianRow, gap: f64, weight: f64) {
        let (blocks, components) = (1 + self.joints, self.components);
        let parts = || std::iter::once((0, row.shift)).chain(row.turns.iter().map(|&(j, d)| (1 + j, d)));
        for (k, (a, x)) in parts().enumerate() {
            let wx = x * weight;
            for (b, y) in parts().skip(k) {
                self.turns[a * blocks + b] += wx * y.transpose();
            }
            for c in 0..3 {
                self.g[3 * a + c] += wx[c] * gap;
                let first = (3 * a + c) * components;
                for (slot, s) in self.turns_by_shape[first..first + components].iter_mut().zip(&row.shape) {
                    *slot += wx[c] * s;
                }
            }
        }
        for (m, &x) in row.shape.iter().enumerate() {
            let wx = weight * x;
            self.g[3 * blocks + m] += wx * gap;
            for (slot, y) in self.shape[m * components + m..(m + 1) * components].iter_mut().zip(&row.shape[m..]) {
                *slot += wx * y;
            }
        }
    }

    pub(super) fn merge(&mut self, other: &Self) {
        self.turns.iter_mut().zip(&other.turns).for_each(|(a, b)| *a += b);
        self.turns_by_shape.iter_mut().zip(&other.turns_by_shape).for_each(|(a, b)| *a += b);
        self.shape.iter_mut().zip(&other.shape).for_each(|(a, b)| *a += b);
        self.g += &other.g;
    }

    /// The whole of `H` and `g`, for so many columns: those of a shape that was held are zero.
    pub(super) fn equations(self, columns: usize) -> NormalEquations {
        let (blocks, components) = (1 + self.joints, self.components);
        let first = 3 * blocks;
        let mut h = DMatrix::zeros(columns, columns);
        for a in 0..blocks {
            for b in a..blocks {
                h.fixed_view_mut::<3, 3>(3 * a, 3 * b).copy_from(&self.turns[a * blocks + b]);
            }
        }
        for r in 0..first {
            for m in 0..components {
                h[(r, first + m)] = self.turns_by_shape[r * components + m];
            }
        }
        for m in 0..components {
            for k in m..components {
                h[(first + m, first + k)] = self.shape[m * components + k];
            }
        }
        h.fill_lower_triangle_with_upper_triangle();
        NormalEquations { h, g: self.g.resize_vertically(columns, 0.0) }
    }
}

/// How strongly each joint is drawn to where it is expected.
pub(crate) struct PosePrior<'a> {
    pub(crate) center: &'a Pose,
    /// 1/σ² a joint, by radians.
    pub(crate) stiffness: &'a [f64],
    pub(crate) limits: &'a [JointLimits],
    pub(crate) limit_stiffness: f64,
}

impl NormalEquations {
    /// Adds the pose prior and the joint limits (one-sided).
    pub(crate) fn add_pose_prior(&mut self, posed: &Posed, pose: &Pose, prior: &PosePrior<'_>) {
        for j in 1..pose.rotations.len() {
            let parent = parent_rotation(posed, j);
            let frame = parent.to_rotation_matrix().into_inner();
            let off = (pose.rotations[j] * prior.center.rotations[j].inverse()).scaled_axis();
            let vector = pose.rotations[j].scaled_axis();
            let mut stiffness = Vec3::repeat(prior.stiffness[j]);
            let mut pull = -off * prior.stiffness[j];
            if let Some(limits) = prior.limits.get(j) {
                for c in 0..3 {
                    let beyond = (vector[c] - limits.max[c]).max(0.0) + (vector[c] - limits.min[c]).min(0.0);
                    if beyond != 0.0 {
                        stiffness[c] += prior.limit_stiffness;
                        pull[c] -= prior.limit_stiffness * beyond;
                    }
                }
            }
            let h = frame * Matrix3::from_diagonal(&stiffness) * frame.transpose();
            let g = frame * pull;
            for a in 0..3 {
                self.g[3 + 3 * j + a] += g[a];
                for b in 0..3 {
                    self.h[(3 + 3 * j + a, 3 + 3 * j + b)] += h[(a, b)];
                }
            }
        }
    }

    /// Adds `stiffness · |β|²` for a component count that ends the unknowns.
    pub(crate) fn add_shape_prior(&mut self, shape: &Shape, stiffness: f64) {
        let first = self.g.len() - shape.0.len();
        for (m, beta) in shape.0.iter().enumerate() {
            self.h[(first + m, first + m)] += stiffness;
            self.g[first + m] -= stiffness * beta;
        }
    }

    /// Takes all but the unknowns out of the step.
    pub(crate) fn freeze_all_but(&mut self, unknowns: &Unknowns) {
        for i in unknowns.held(self.g.len()) {
            self.h.row_mut(i).fill(0.0);
            self.h.column_mut(i).fill(0.0);
            self.h[(i, i)] = 1.0;
            self.g[i] = 0.0;
        }
    }

    /// The minimising step, damped relative to the diagonal; `None` where the system cannot be factored.
    pub(crate) fn solve(&self, damping: f64) -> Option<DVector<f64>> {
        let mut h = self.h.clone();
        for i in 0..h.nrows() {
            h[(i, i)] = h[(i, i)] * (1.0 + damping) + 1e-9;
        }
        h.cholesky().map(|c| c.solve(&self.g)).filter(|d| d.iter().all(|x| x.is_finite()))
    }
}

pub(super) fn parent_rotation(posed: &Posed, joint: usize) -> UnitQuaternion<f64> {
    match posed.skeleton.parents[joint] {
        Some(p) => posed.world_from_bind[p.index()].rotation,
        None => UnitQuaternion::identity(),
    }
}
