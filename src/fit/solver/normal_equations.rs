//! The normal equations of a Gauss–Newton step, with priors and joint limits.

use super::posed::{Posed, parent_rotation};
use crate::body::{JointLimits, Pose, Shape, Skeleton};
use crate::geometry::Vec3;
use nalgebra::{DMatrix, DVector, Matrix3};

/// What a step may change in addition to the translation.
#[derive(Clone, Debug)]
pub(crate) struct Unknowns {
    /// Joints that may turn. **Shapes** one entry per joint.
    pub(crate) joints: Vec<bool>,
    /// Whether the shape may change.
    pub(crate) shape: bool,
}

impl Unknowns {
    /// These joints without those of fingers, which no scan of a whole person determines one by one.
    pub(crate) fn without_fingers(skeleton: &Skeleton, mut joints: Vec<bool>, shape: bool) -> Self {
        for (free, joint) in joints.iter_mut().zip(skeleton.ids()) {
            *free &= !skeleton.is_finger(joint);
        }
        Self { joints, shape }
    }

    /// Columns of what a step does not change.
    fn held(&self, columns: usize) -> impl Iterator<Item = usize> + '_ {
        let first = 3 + 3 * self.joints.len();
        let joints = (0..self.joints.len()).filter(|j| !self.joints[*j]).flat_map(|j| 3 + 3 * j..6 + 3 * j);
        joints.chain((first..columns).filter(|_| !self.shape))
    }
}

/// The quadratic model `½ δᵀHδ − gᵀδ` of a step `δ`. **Shapes** `H` is `n × n`, `g` is `n`.
#[derive(Clone)]
pub(crate) struct NormalEquations {
    pub(crate) h: DMatrix<f64>,
    pub(crate) g: DVector<f64>,
}

/// The prior that pulls each joint to its expected rotation.
pub(crate) struct PosePrior<'a> {
    pub(crate) center: &'a Pose,
    /// 1/σ² per joint, in 1/radians².
    pub(crate) stiffness: &'a [f64],
    pub(crate) limits: &'a [JointLimits],
}

/// Stiffness of a joint that exceeds its limit: 1/σ² for σ = 0.4°.
const LIMIT_STIFFNESS: f64 = 2e4;

/// Damping of a step relative to the diagonal: joints that no data determines do not move.
pub(crate) const DAMPING: f64 = 1e-4;

/// The linear system of a step cannot be factored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Singular;

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
                    let excess = (vector[c] - limits.max[c]).max(0.0) + (vector[c] - limits.min[c]).min(0.0);
                    if excess != 0.0 {
                        stiffness[c] += LIMIT_STIFFNESS;
                        pull[c] -= LIMIT_STIFFNESS * excess;
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

    /// Adds `stiffness · |β|²`; the shape coefficients are the last unknowns.
    pub(crate) fn add_shape_prior(&mut self, shape: &Shape, stiffness: f64) {
        let first = self.g.len() - shape.0.len();
        for (m, beta) in shape.0.iter().enumerate() {
            self.h[(first + m, first + m)] += stiffness;
            self.g[first + m] -= stiffness * beta;
        }
    }

    /// Fixes everything that is not in `unknowns`: its step is zero.
    pub(crate) fn freeze_all_but(&mut self, unknowns: &Unknowns) {
        for i in unknowns.held(self.g.len()) {
            self.h.row_mut(i).fill(0.0);
            self.h.column_mut(i).fill(0.0);
            self.h[(i, i)] = 1.0;
            self.g[i] = 0.0;
        }
    }

    /// Damps the step relative to the diagonal.
    pub(crate) fn damp(&mut self, damping: f64) {
        for i in 0..self.h.nrows() {
            self.h[(i, i)] = self.h[(i, i)] * (1.0 + damping) + 1e-9;
        }
    }

    /// The minimising step, damped relative to the diagonal.
    pub(crate) fn solve(&self, damping: f64) -> Result<DVector<f64>, Singular> {
        let free: Vec<usize> = (0..self.g.len()).filter(|&i| self.is_active(i)).collect();
        let n = free.len();
        let mut damped = Self {
            h: DMatrix::from_fn(n, n, |i, j| self.h[(free[i], free[j])]),
            g: DVector::from_fn(n, |i, _| self.g[free[i]]),
        };
        damped.damp(damping);
        let found = damped.h.cholesky().map(|c| c.solve(&damped.g)).ok_or(Singular)?;
        let mut step = DVector::zeros(self.g.len());
        free.iter().zip(found.iter()).for_each(|(&i, x)| step[i] = *x);
        step.iter().all(|x| x.is_finite()).then_some(step).ok_or(Singular)
    }

    /// Whether an unknown has a gradient or depends on others; all else has a step of zero.
    fn is_active(&self, i: usize) -> bool {
        self.g[i] != 0.0 || self.h.column(i).iter().enumerate().any(|(j, x)| j != i && *x != 0.0)
    }
}

/// The steps of several bodies that share one shape, each with its own pose. The poses are eliminated (Schur complement), which
/// leaves a system of the shape. `shape` and `stiffness` are the shape prior, which counts once.
///
/// **Requires** equations with equal numbers of joints and of components, and a free shape.
pub(crate) fn solve_together(
    parts: &[NormalEquations],
    shape: &Shape,
    stiffness: f64,
    damping: f64,
) -> Result<Vec<DVector<f64>>, Singular> {
    let components = shape.0.len();
    let (mut left, mut right, poses) = without_poses(parts, components, damping)?;
    for (m, beta) in shape.0.iter().enumerate() {
        left[(m, m)] += stiffness;
        right[m] -= stiffness * beta;
    }
    for i in 0..components {
        left[(i, i)] = left[(i, i)] * (1.0 + damping) + 1e-9;
    }
    let of_shape = left.cholesky().ok_or(Singular)?.solve(&right);
    let whole = |(alone, turned): (DVector<f64>, DMatrix<f64>)| {
        let of_pose = alone - turned * &of_shape;
        DVector::from_iterator(of_pose.len() + components, of_pose.iter().chain(of_shape.iter()).copied())
    };
    let steps: Vec<DVector<f64>> = poses.into_iter().map(whole).collect();
    steps.iter().flatten().all(|x| x.is_finite()).then_some(steps).ok_or(Singular)
}

/// What the bodies say of their common shape, whatever their poses, with the shape prior: the inverse of the covariance of β
/// (Laplace). **Shapes** K × K.
pub(crate) fn shape_information(
    parts: &[NormalEquations],
    components: usize,
    stiffness: f64,
) -> Result<DMatrix<f64>, Singular> {
    let (left, ..) = without_poses(parts, components, 0.0)?;
    Ok(left + DMatrix::from_diagonal_element(components, components, stiffness))
}

/// The step of a pose without any change of the shape, and its change per coefficient.
type EliminatedPose = (DVector<f64>, DMatrix<f64>);

/// Matrix and right-hand side of a shape, and the eliminated poses.
type ShapeSystem = (DMatrix<f64>, DVector<f64>, Vec<EliminatedPose>);

/// The system of the shape, without its prior, after the poses are eliminated.
fn without_poses(parts: &[NormalEquations], components: usize, damping: f64) -> Result<ShapeSystem, Singular> {
    let (mut left, mut right) = (DMatrix::zeros(components, components), DVector::zeros(components));
    let mut poses = Vec::with_capacity(parts.len());
    for NormalEquations { h, g } in parts {
        let pose = h.nrows() - components;
        let mut of_pose = h.view((0, 0), (pose, pose)).into_owned();
        for i in 0..pose {
            of_pose[(i, i)] = of_pose[(i, i)] * (1.0 + damping) + 1e-9;
        }
        let factor = of_pose.cholesky().ok_or(Singular)?;
        let by_shape = h.view((0, pose), (pose, components)).into_owned();
        let (turned, alone) = (factor.solve(&by_shape), factor.solve(&g.rows(0, pose).into_owned()));
        left += h.view((pose, pose), (components, components)) - by_shape.transpose() * &turned;
        right += g.rows(pose, components) - by_shape.transpose() * &alone;
        poses.push((alone, turned));
    }
    Ok((left, right, poses))
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
