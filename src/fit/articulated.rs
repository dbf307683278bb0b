//! The articulated Gauss–Newton step that both fits share.
//!
//! Unknowns of a step, in this order: translation (3), a rotation increment a joint (3 each, axes of the world, about
//! the joint's present centre, turning all that hangs below), shape increments (K).
//!
//! **Source** Hu 2017, Eqs. 3–6; the Jacobian of a skinned point is that of Tagliasacchi 2015, §4, with the joints'
//! own dependence on β kept.

use crate::body::{BodyModel, JointLimits, Pose, Shape, Skeleton, SkinWeights, skin_rigidly};
use crate::geometry::{PerVertex, Point, Vec3, VertexId};
use nalgebra::{DMatrix, DVector, Isometry3, Matrix3, Translation3, UnitQuaternion};
use rayon::prelude::*;

/// What is posed: points in the bind pose with weights, and the shape space where there is one.
pub(crate) struct Articulated<'a> {
    pub(crate) skeleton: Skeleton,
    pub(crate) points_in_bind: PerVertex<Point>,
    pub(crate) weights: &'a SkinWeights,
    pub(crate) model: Option<&'a BodyModel>,
}

/// The same in one pose, with all that a Jacobian needs.
pub(crate) struct Posed {
    pub(crate) points: PerVertex<Point>,
    pub(crate) skeleton: Skeleton,
    pub(crate) joints_in_world: Vec<Point>,
    points_in_bind: PerVertex<Point>,
    world_from_bind: Vec<Isometry3<f64>>,
    /// J × K: the translation of each joint's transform by each component.
    translation_dirs: Vec<Vec<Vec3>>,
}

/// `normal · (Σ factor · vertex) → normal · (…) + gap`, squared and weighed.
#[derive(Clone, Debug)]
pub(crate) struct Residual {
    pub(crate) at: [(VertexId, f64); 3],
    pub(crate) normal: Vec3,
    pub(crate) gap: f64,
    pub(crate) weight: f64,
}

impl Residual {
    pub(crate) fn on_vertex(vertex: VertexId, normal: Vec3, gap: f64, weight: f64) -> Self {
        Self { at: [(vertex, 1.0), (vertex, 0.0), (vertex, 0.0)], normal, gap, weight }
    }
}

/// `½ δᵀHδ − gᵀδ`.
pub(crate) struct NormalEquations {
    pub(crate) h: DMatrix<f64>,
    pub(crate) g: DVector<f64>,
}

impl Posed {
    /// Normals of the bind pose turned as the points were.
    pub(crate) fn normals(&self, normals_in_bind: &PerVertex<Vec3>, weights: &SkinWeights) -> PerVertex<Vec3> {
        normals_in_bind
            .iter()
            .zip(weights.rows().iter())
            .map(|(n, row)| {
                let turned: Vec3 = row.iter().map(|(j, w)| self.world_from_bind[j.index()].rotation * n * *w).sum();
                turned.try_normalize(1e-9).unwrap_or(*n)
            })
            .collect()
    }
}

impl<'a> Articulated<'a> {
    /// A model of mean shape.
    pub(crate) fn of_model(model: &'a BodyModel) -> Self {
        Self {
            skeleton: model.skeleton.clone(),
            points_in_bind: model.template.points().clone(),
            weights: &model.weights,
            model: Some(model),
        }
    }

    pub(crate) fn joint_count(&self) -> usize {
        self.skeleton.len()
    }

    pub(crate) fn component_count(&self) -> usize {
        self.model.map_or(0, BodyModel::component_count)
    }

    /// How many unknowns a step has.
    pub(crate) fn unknown_count(&self) -> usize {
        3 + 3 * self.joint_count() + self.component_count()
    }

    pub(crate) fn posed(&self, pose: &Pose, shape: &Shape) -> Posed {
        let (points_in_bind, skeleton) = match self.model {
            Some(model) => {
                let (mesh, skeleton) = model.shaped(shape);
                (mesh.points().clone(), skeleton)
            }
            None => (self.points_in_bind.clone(), self.skeleton.clone()),
        };
        let world_from_bind = skeleton.world_from_bind(pose);
        let joints_in_world: Vec<Point> =
            world_from_bind.iter().zip(&skeleton.joints_in_bind).map(|(t, p)| t * p).collect();
        // Steps take corrective offsets for constant: a radian moves them by centimetres, and the skin by decimetres.
        let points_in_bind = self.weights.given_way(&points_in_bind, pose);
        let points = skin_rigidly(&points_in_bind, self.weights, &skeleton, pose);
        let translation_dirs = self.translation_dirs(&skeleton, &world_from_bind);
        Posed { points, skeleton, joints_in_world, points_in_bind, world_from_bind, translation_dirs }
    }

    /// With `J` the joint in the bind pose and `C` in the world, a transform is `v ↦ R(v − J) + C`, so its
    /// translation changes by `dC − R dJ`, and `dC` adds up along the chain.
    fn translation_dirs(&self, skeleton: &Skeleton, world_from_bind: &[Isometry3<f64>]) -> Vec<Vec<Vec3>> {
        let Some(model) = self.model else { return vec![Vec::new(); skeleton.len()] };
        let count = model.component_count();
        let mut center_dirs: Vec<Vec<Vec3>> = Vec::with_capacity(skeleton.len());
        let mut out = Vec::with_capacity(skeleton.len());
        for j in 0..skeleton.len() {
            let dirs: Vec<Vec3> = (0..count)
                .map(|m| match skeleton.parents[j] {
                    None => model.joint_dirs[m][j],
                    Some(p) => {
                        center_dirs[p.index()][m]
                            + world_from_bind[p.index()].rotation
                                * (model.joint_dirs[m][j] - model.joint_dirs[m][p.index()])
                    }
                })
                .collect();
            out.push((0..count).map(|m| dirs[m] - world_from_bind[j].rotation * model.joint_dirs[m][j]).collect());
            center_dirs.push(dirs);
        }
        out
    }

    /// Derivative of `normal · point` by the unknowns, as (column, value).
    pub(crate) fn gradient(&self, posed: &Posed, residual: &Residual) -> Vec<(usize, f64)> {
        let joint_count = self.joint_count();
        let n = residual.normal;
        let mut row: Vec<(usize, f64)> = (0..3).map(|c| (c, 0.0)).collect();
        // For each joint above any influence: Σ w (G v) and Σ w over what hangs below it.
        let mut arms: Vec<(usize, Vec3, f64)> = Vec::with_capacity(12);
        let mut shape_row = vec![0.0; self.component_count()];
        for &(v, factor) in &residual.at {
            if factor == 0.0 {
                continue;
            }
            for c in 0..3 {
                row[c].1 += factor * n[c];
            }
            let mut linear = Matrix3::zeros();
            for &(k, w) in &self.weights.rows()[v] {
                if w <= 0.0 {
                    continue;
                }
                let w = w * factor;
                let moved = posed.world_from_bind[k.index()] * posed.points_in_bind[v];
                linear += posed.world_from_bind[k.index()].rotation.to_rotation_matrix().matrix() * w;
                let mut at = Some(k);
                while let Some(j) = at {
                    match arms.iter_mut().find(|(i, _, _)| *i == j.index()) {
                        Some((_, arm, total)) => {
                            *arm += moved.coords * w;
                            *total += w;
                        }
                        None => arms.push((j.index(), moved.coords * w, w)),
                    }
                    at = posed.skeleton.parents[j.index()];
                }
                for (m, slot) in shape_row.iter_mut().enumerate() {
                    *slot += w * n.dot(&posed.translation_dirs[k.index()][m]);
                }
            }
            if let Some(model) = self.model {
                let back = linear.transpose() * n;
                for (slot, dirs) in shape_row.iter_mut().zip(&model.shape_dirs) {
                    *slot += back.dot(&dirs[v]);
                }
            }
        }
        for (j, arm, total) in arms {
            let d = (arm - posed.joints_in_world[j].coords * total).cross(&n);
            for c in 0..3 {
                row.push((3 + 3 * j + c, d[c]));
            }
        }
        row.extend(shape_row.into_iter().enumerate().map(|(m, x)| (3 + 3 * joint_count + m, x)));
        row
    }

    /// Sums all residuals; the order of summation does not depend on the number of threads.
    pub(crate) fn normal_equations(&self, posed: &Posed, residuals: &[Residual]) -> NormalEquations {
        /// Residuals a task: large enough to hide a task's own cost.
        const CHUNK: usize = 512;
        let n = self.unknown_count();
        let parts: Vec<NormalEquations> = residuals
            .par_chunks(CHUNK)
            .map(|chunk| {
                let mut sum = NormalEquations { h: DMatrix::zeros(n, n), g: DVector::zeros(n) };
                for residual in chunk {
                    let row = self.gradient(posed, residual);
                    for &(a, x) in &row {
                        let wx = residual.weight * x;
                        sum.g[a] += wx * residual.gap;
                        for &(b, y) in &row {
                            sum.h[(a, b)] += wx * y;
                        }
                    }
                }
                sum
            })
            .collect();
        let mut total = NormalEquations { h: DMatrix::zeros(n, n), g: DVector::zeros(n) };
        for part in parts {
            total.h += part.h;
            total.g += part.g;
        }
        total
    }

    /// Applies a step.
    pub(crate) fn stepped(&self, posed: &Posed, pose: &Pose, shape: &Shape, delta: &DVector<f64>) -> (Pose, Shape) {
        let mut pose = pose.clone();
        pose.translation += Vec3::new(delta[0], delta[1], delta[2]);
        for j in 0..self.joint_count() {
            let turn = Vec3::new(delta[3 + 3 * j], delta[4 + 3 * j], delta[5 + 3 * j]);
            let parent = parent_rotation(posed, j);
            pose.rotations[j] = UnitQuaternion::from_scaled_axis(parent.inverse() * turn) * pose.rotations[j];
            pose.rotations[j].renormalize();
        }
        let mut shape = shape.clone();
        for (m, beta) in shape.0.iter_mut().enumerate() {
            *beta += delta[3 + 3 * self.joint_count() + m];
        }
        (pose, shape)
    }
}

fn parent_rotation(posed: &Posed, joint: usize) -> UnitQuaternion<f64> {
    match posed.skeleton.parents[joint] {
        Some(p) => posed.world_from_bind[p.index()].rotation,
        None => UnitQuaternion::identity(),
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

    /// Takes unknowns out of the step.
    pub(crate) fn freeze(&mut self, frozen: impl Iterator<Item = usize>) {
        for i in frozen {
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

/// A pose that carries the bind pose's root to a heading about +Y and a place.
pub(crate) fn standing(skeleton: &Skeleton, heading: f64, hips_at: Point) -> Pose {
    let mut pose = Pose::bind(skeleton.len());
    pose.rotations[0] = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), heading);
    pose.translation = hips_at - skeleton.joints_in_bind[0];
    debug_assert!(Translation3::from(pose.translation).vector.iter().all(|x| x.is_finite()));
    pose
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::embedded_model;

    /// A pose with every joint turned, so that no term of the Jacobian vanishes.
    fn turned(joints: usize) -> Pose {
        let mut pose = Pose::bind(joints);
        pose.translation = Vec3::new(0.1, -0.2, 0.3);
        for (j, r) in pose.rotations.iter_mut().enumerate() {
            let t = j as f64;
            *r = UnitQuaternion::from_scaled_axis(Vec3::new((t * 0.7).sin(), (t * 1.3).cos(), (t * 0.4).sin()) * 0.3);
        }
        pose
    }

    #[test]
    fn the_jacobian_is_that_of_finite_differences() {
        let model = embedded_model().unwrap();
        let body = Articulated::of_model(&model);
        let pose = turned(body.joint_count());
        let shape = Shape((0..body.component_count()).map(|k| 0.5 - 0.1 * k as f64).collect());
        let posed = body.posed(&pose, &shape);
        let normal = Vec3::new(0.48, -0.6, 0.64);
        let step = 1e-6;
        for v in (0..model.template.vertex_count()).step_by(997).map(VertexId::from_index) {
            let mut analytic = vec![0.0; body.unknown_count()];
            for (column, value) in body.gradient(&posed, &Residual::on_vertex(v, normal, 0.0, 1.0)) {
                analytic[column] += value;
            }
            for (column, expected) in analytic.iter().enumerate() {
                let height = |sign: f64| {
                    let mut delta = DVector::zeros(body.unknown_count());
                    delta[column] = sign * step;
                    let (p, s) = body.stepped(&posed, &pose, &shape, &delta);
                    normal.dot(&body.posed(&p, &s).points[v].coords)
                };
                let numeric = (height(1.0) - height(-1.0)) / (2.0 * step);
                assert!(
                    (numeric - expected).abs() < 1e-5,
                    "vertex {v:?}, unknown {column}: {numeric} against {expected}"
                );
            }
        }
    }

    #[test]
    fn summing_does_not_depend_on_the_number_of_threads() {
        let model = embedded_model().unwrap();
        let body = Articulated::of_model(&model);
        let posed = body.posed(&turned(body.joint_count()), &model.mean_shape());
        let residuals: Vec<Residual> = (0..3000)
            .map(|i| {
                Residual::on_vertex(
                    VertexId(i),
                    Vec3::new(0.0, 0.6, 0.8),
                    1e-3 * f64::from(i % 7),
                    1.0 / f64::from(1 + i % 5),
                )
            })
            .collect();
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| body.normal_equations(&posed, &residuals))
        };
        let (one, four) = (with(1), with(4));
        assert!(one.h == four.h && one.g == four.g, "the same bits");
    }
}
