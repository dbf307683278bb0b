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

/// The steps of several bodies that share one shape, each with its own pose: the shape's system is what is left of all when
/// their poses are eliminated (Schur complement). `shape` and `stiffness` are the shape prior, which counts once.
///
/// **Requires** equations of as many joints and as many components, whose shape is free. `None` where a system cannot be factored.
pub(crate) fn solve_together(
    parts: &[NormalEquations],
    shape: &Shape,
    stiffness: f64,
    damping: f64,
) -> Option<Vec<DVector<f64>>> {
    let components = shape.0.len();
    let mut left = DMatrix::from_diagonal_element(components, components, stiffness);
    let mut right = DVector::from_iterator(components, shape.0.iter().map(|beta| -stiffness * beta));
    let mut poses = Vec::with_capacity(parts.len());
    for NormalEquations { h, g } in parts {
        let pose = h.nrows() - components;
        let mut of_pose = h.view((0, 0), (pose, pose)).into_owned();
        for i in 0..pose {
            of_pose[(i, i)] = of_pose[(i, i)] * (1.0 + damping) + 1e-9;
        }
        let factor = of_pose.cholesky()?;
        let by_shape = h.view((0, pose), (pose, components)).into_owned();
        let (turned, alone) = (factor.solve(&by_shape), factor.solve(&g.rows(0, pose).into_owned()));
        left += h.view((pose, pose), (components, components)) - by_shape.transpose() * &turned;
        right += g.rows(pose, components) - by_shape.transpose() * &alone;
        poses.push((alone, turned));
    }
    for i in 0..components {
        left[(i, i)] = left[(i, i)] * (1.0 + damping) + 1e-9;
    }
    let of_shape = left.cholesky()?.solve(&right);
    let whole = |(alone, turned): (DVector<f64>, DMatrix<f64>)| {
        let of_pose = alone - turned * &of_shape;
        DVector::from_iterator(of_pose.len() + components, of_pose.iter().chain(of_shape.iter()).copied())
    };
    let steps: Vec<DVector<f64>> = poses.into_iter().map(whole).collect();
    steps.iter().flatten().all(|x| x.is_finite()).then_some(steps)
}

pub(super) fn parent_rotation(posed: &Posed, joint: usize) -> UnitQuaternion<f64> {
    match posed.skeleton.parents[joint] {
        Some(p) => posed.world_from_bind[p.index()].rotation,
        None => UnitQuaternion::identity(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::noise;

    #[test]
    fn steps_of_one_shape_are_those_of_the_whole_system() {
        const POSE: usize = 9;
        const SHAPE: usize = 4;
        const STIFFNESS: f64 = 3.0;
        let mut next = noise(5);
        let parts: Vec<NormalEquations> = (0..3)
            .map(|_| {
                let rows = DMatrix::from_fn(40, POSE + SHAPE, |_, _| next());
                let gaps = DVector::from_fn(40, |_, _| next());
                NormalEquations { h: rows.transpose() * &rows, g: rows.transpose() * gaps }
            })
            .collect();
        let shape = Shape(vec![0.3, -1.0, 0.0, 2.0]);
        let found = solve_together(&parts, &shape, STIFFNESS, 0.0).unwrap();

        let count = parts.len() * POSE + SHAPE;
        let (mut h, mut g) = (DMatrix::zeros(count, count), DVector::zeros(count));
        let last = count - SHAPE;
        for (k, part) in parts.iter().enumerate() {
            let place = |i: usize| if i < POSE { k * POSE + i } else { last + i - POSE };
            for i in 0..POSE + SHAPE {
                g[place(i)] += part.g[i];
                for j in 0..POSE + SHAPE {
                    h[(place(i), place(j))] += part.h[(i, j)];
                }
            }
        }
        for (m, beta) in shape.0.iter().enumerate() {
            h[(last + m, last + m)] += STIFFNESS;
            g[last + m] -= STIFFNESS * beta;
        }
        let whole = h.cholesky().unwrap().solve(&g);
        for (k, step) in found.iter().enumerate() {
            assert!((step.rows(0, POSE) - whole.rows(k * POSE, POSE)).amax() < 1e-7);
            assert!((step.rows(POSE, SHAPE) - whole.rows(last, SHAPE)).amax() < 1e-7);
        }
    }
}
