//! The articulated surface that all fits share: posing, Jacobian and Gauss–Newton step.
//!
//! Unknowns of a step, in this order: translation (3); one rotation increment per joint (3 each, world axes, about the joint's
//! present centre, rotating its whole subtree); shape increments (K).
//!
//! **Source** Hu 2017, Eqs. 3–6; the Jacobian of a skinned point is that of Tagliasacchi 2015, §4, with the joints'
//! own dependence on β included.

use super::bone_sums::{BoneSums, Wrench};
use super::normal_equations::{NormalEquations, Unknowns};
use super::posed::{Posed, Residual, parent_rotation};
use crate::body::{BodyModel, JointId, Pose, Shape, Skeleton, SkinWeights, skin_rigidly};
use crate::geometry::{PerVertex, Point, Vec3, VertexId};
use crate::numerics::{Kernel, Processor};
use nalgebra::{DVector, Isometry3, UnitQuaternion};
use rayon::prelude::*;

/// The surface to pose: points in the bind pose with skin weights, and the shape space if it has one.
pub(crate) struct Articulated<'a> {
    pub(crate) skeleton: Skeleton,
    pub(crate) points_in_bind: PerVertex<Point>,
    pub(crate) weights: &'a SkinWeights,
    pub(crate) model: Option<&'a BodyModel>,
    /// Shape directions, the components of a vertex side by side; empty without a model. **Shapes** `V × K`.
    shape_dirs: Vec<Vec3>,
    /// All joints but those of fingers.
    body_joints: Vec<usize>,
}

/// Residuals to sum, dispatched to the processor's instruction set: `inline(always)` below, so that everything is compiled
/// for it.
struct SumUp<'a, 'b> {
    body: &'b Articulated<'a>,
    posed: &'b Posed,
    residuals: &'b [Residual],
    sums: &'b mut BoneSums,
}

impl Kernel for SumUp<'_, '_> {
    #[inline(always)]
    fn run(self) {
        self.body.sum_up(self.posed, self.residuals, self.sums);
    }
}

impl<'a> Articulated<'a> {
    /// A body model; its shape is an unknown.
    pub(crate) fn of_model(model: &'a BodyModel) -> Self {
        Self {
            body_joints: body_joints(&model.skeleton),
            skeleton: model.skeleton.clone(),
            points_in_bind: model.template.points().clone(),
            weights: &model.weights,
            model: Some(model),
            shape_dirs: model
                .template
                .vertex_ids()
                .flat_map(|v| model.shape_dirs.iter().map(move |dirs| dirs[v]))
                .collect(),
        }
    }

    /// A figure of fixed shape.
    pub(crate) fn of_points(skeleton: &Skeleton, points_in_bind: PerVertex<Point>, weights: &'a SkinWeights) -> Self {
        let (body_joints, skeleton) = (body_joints(skeleton), skeleton.clone());
        Self { skeleton, points_in_bind, weights, model: None, shape_dirs: Vec::new(), body_joints }
    }

    pub(crate) fn joint_count(&self) -> usize {
        self.skeleton.len()
    }

    pub(crate) fn component_count(&self) -> usize {
        self.model.map_or(0, BodyModel::component_count)
    }

    /// Number of unknowns of a step.
    pub(crate) fn unknown_count(&self) -> usize {
        3 + 3 * self.joint_count() + self.component_count()
    }

    /// The greatest move of a joint from a pose to where its joints are after a step, in metres. Fingers do not count: they turn with the
    /// hand, farther out.
    pub(crate) fn greatest_move(&self, posed: &Posed, joints_after: &[Point]) -> f64 {
        self.body_joints.iter().map(|&j| (posed.joints_in_world[j] - joints_after[j]).norm()).fold(0.0, f64::max)
    }

    pub(crate) fn posed(&self, pose: &Pose, shape: &Shape) -> Posed {
        let (points_in_bind, skeleton) = match self.model {
            Some(model) => (self.shaped(shape), model.skeleton_of(shape)),
            None => (self.points_in_bind.clone(), self.skeleton.clone()),
        };
        let world_from_bind = skeleton.world_from_bind(pose);
        let joints_in_world: Vec<Point> =
            world_from_bind.iter().zip(&skeleton.joints_in_bind).map(|(t, p)| t * p).collect();
        // A step treats corrective offsets as constant: per radian they move by centimetres, the skin by decimetres.
        let points_in_bind = self.weights.with_pose_offsets(&points_in_bind, pose);
        let points = skin_rigidly(&points_in_bind, self.weights, &skeleton, pose);
        let translation_dirs = self.translation_dirs(&skeleton, &world_from_bind);
        let rotations = world_from_bind.iter().map(|t| t.rotation.to_rotation_matrix().into_inner()).collect();
        Posed { points, skeleton, joints_in_world, points_in_bind, world_from_bind, rotations, translation_dirs }
    }

    fn shaped(&self, shape: &Shape) -> PerVertex<Point> {
        let count = self.component_count().max(1);
        let moved = |(p, dirs): (&Point, &[Vec3])| dirs.iter().zip(&shape.0).fold(*p, |p, (dir, beta)| p + dir * *beta);
        if self.shape_dirs.is_empty() {
            return self.points_in_bind.clone();
        }
        self.points_in_bind.0.par_iter().zip(self.shape_dirs.par_chunks(count)).map(moved).collect::<Vec<_>>().into()
    }

    /// With `J` the joint in the bind pose and `C` in the world, a transform is `v ↦ R(v − J) + C`, so its
    /// translation changes by `dC − R dJ`, and `dC` accumulates along the chain.
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

    /// Derivative of `normal · point` with respect to the unknowns, as (column, value).
    pub(crate) fn gradient(&self, posed: &Posed, residual: &Residual) -> Vec<(usize, f64)> {
        let (mut wrenches, mut shape) = (Vec::new(), vec![0.0; self.component_count()]);
        self.wrenches(posed, residual, &mut wrenches, &mut shape);
        // A joint rotates its whole subtree.
        let mut below: Vec<(usize, Vec3, Vec3)> = Vec::with_capacity(16);
        let mut shift = Vec3::zeros();
        for wrench in &wrenches {
            let (moment, force) = wrench.moment_and_force();
            shift += force;
            let mut at = Some(wrench.bone);
            while let Some(j) = at {
                match below.iter_mut().find(|sum| sum.0 == j) {
                    Some((_, moments, forces)) => (*moments, *forces) = (*moments + moment, *forces + force),
                    None => below.push((j, moment, force)),
                }
                at = posed.skeleton.parents[j].map(JointId::index);
            }
        }
        below.sort_unstable_by_key(|sum| sum.0);
        let of = |first: usize, v: &Vec3| [(first, v.x), (first + 1, v.y), (first + 2, v.z)];
        let turns = below.iter().flat_map(|(j, moment, force)| {
            let center = posed.joints_in_world[*j].coords;
            of(3 + 3 * j, &(moment - center.cross(force)))
        });
        let first = 3 + 3 * self.joint_count();
        let shape = shape.iter().enumerate().map(|(m, &x)| (first + m, x));
        of(0, &shift).into_iter().chain(turns).chain(shape).collect()
    }

    /// How each shape component moves a vertex of the bind pose. **Shapes** `K`.
    fn dirs_of(&self, v: VertexId) -> &[Vec3] {
        let count = self.component_count();
        &self.shape_dirs[v.index() * count..(v.index() + 1) * count]
    }

    /// Sums all residuals. Everything that is not an unknown has a step of zero.
    ///
    /// **Guarantees** the order of summation does not depend on the number of threads.
    pub(crate) fn normal_equations(
        &self,
        posed: &Posed,
        residuals: &[Residual],
        unknowns: &Unknowns,
    ) -> NormalEquations {
        /// Residuals per task: large enough to hide the cost of a task.
        const CHUNK: usize = 1024;
        let components = if unknowns.shape { self.component_count() } else { 0 };
        let zero = || BoneSums::zero(self.joint_count(), components);
        let processor = Processor::detect();
        let parts: Vec<BoneSums> = residuals
            .par_chunks(CHUNK)
            .map(|chunk| {
                let mut sums = zero();
                processor.dispatch(SumUp { body: self, posed, residuals: chunk, sums: &mut sums });
                sums
            })
            .collect();
        let mut parts = parts.into_iter();
        let mut total = parts.next().unwrap_or_else(zero);
        parts.for_each(|part| total.merge(&part));
        total.equations(posed, unknowns, self.unknown_count())
    }

    #[inline(always)]
    fn sum_up(&self, posed: &Posed, residuals: &[Residual], sums: &mut BoneSums) {
        let (mut wrenches, mut shape) = (Vec::new(), vec![0.0; sums.shape_width()]);
        for residual in residuals {
            self.wrenches(posed, residual, &mut wrenches, &mut shape);
            sums.add(&wrenches, &shape, residual.gap, residual.weight);
        }
    }

    /// Derivative of `normal · point` by each bone that moves the point, and by the shape unless `shape` is empty.
    #[inline(always)]
    fn wrenches(&self, posed: &Posed, residual: &Residual, wrenches: &mut Vec<Wrench>, shape: &mut [f64]) {
        let n = residual.normal;
        wrenches.clear();
        shape.fill(0.0);
        for &(v, factor) in residual.at.iter().filter(|at| at.1 != 0.0) {
            let in_bind = posed.points_in_bind[v].coords;
            let mut back = Vec3::zeros();
            for &(k, w) in self.weights.rows()[v].iter().filter(|row| row.1 > 0.0) {
                let (k, w) = (k.index(), w * factor);
                let turn = &posed.rotations[k];
                let place = turn * in_bind + posed.world_from_bind[k].translation.vector;
                let (moment, force) = (place.cross(&n) * w, n * w);
                if !shape.is_empty() {
                    back += turn.tr_mul(&force);
                }
                let values = [moment.x, moment.y, moment.z, force.x, force.y, force.z, 0.0, 0.0];
                match wrenches.iter_mut().find(|wrench| wrench.bone == k) {
                    Some(wrench) => wrench.values.iter_mut().zip(&values).for_each(|(sum, x)| *sum += x),
                    None => wrenches.push(Wrench { bone: k, values }),
                }
            }
            for (slot, dir) in shape.iter_mut().zip(self.dirs_of(v)) {
                *slot += back.dot(dir);
            }
        }
        for wrench in wrenches.iter() {
            let (_, force) = wrench.moment_and_force();
            for (slot, dir) in shape.iter_mut().zip(&posed.translation_dirs[wrench.bone]) {
                *slot += force.dot(dir);
            }
        }
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

fn body_joints(skeleton: &Skeleton) -> Vec<usize> {
    skeleton.ids().filter(|&j| !skeleton.is_finger(j)).map(JointId::index).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::embedded_model;
    use nalgebra::DMatrix;

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

    fn residuals(count: u32) -> Vec<Residual> {
        (0..count)
            .map(|i| Residual {
                at: [(VertexId(i), 0.5), (VertexId(i + 40), 0.3), (VertexId(i + 90), 0.2)],
                normal: Vec3::new(0.0, 0.6, 0.8),
                gap: 1e-3 * f64::from(i % 7),
                weight: 1.0 / f64::from(1 + i % 5),
            })
            .collect()
    }

    #[test]
    fn sums_are_those_of_whole_rows_and_what_is_held_stays() {
        let model = embedded_model().unwrap();
        let body = Articulated::of_model(&model);
        let posed = body.posed(&turned(body.joint_count()), &model.mean_shape());
        let residuals = residuals(700);
        let columns = body.unknown_count();
        let (mut h, mut g) = (DMatrix::<f64>::zeros(columns, columns), DVector::<f64>::zeros(columns));
        for residual in &residuals {
            let mut row = DVector::zeros(columns);
            body.gradient(&posed, residual).into_iter().for_each(|(column, x)| row[column] += x);
            h += residual.weight * &row * row.transpose();
            g += residual.weight * residual.gap * &row;
        }
        let all = Unknowns { joints: vec![true; body.joint_count()], shape: true };
        let sums = body.normal_equations(&posed, &residuals, &all);
        assert!((&sums.h - &h).amax() < 1e-9 * h.amax() && (&sums.g - &g).amax() < 1e-9 * g.amax());

        let some = Unknowns { joints: (0..body.joint_count()).map(|j| j % 3 > 0).collect(), shape: false };
        let mut sums = body.normal_equations(&posed, &residuals, &some);
        sums.freeze_all_but(&some);
        let is_free = |c: usize| c < 3 || (c < 3 + 3 * body.joint_count() && some.joints[(c - 3) / 3]);
        for c in 0..columns {
            for d in 0..columns {
                let expected = match (is_free(c) && is_free(d), c == d) {
                    (true, _) => h[(c, d)],
                    (false, on_diagonal) => f64::from(u8::from(on_diagonal)),
                };
                assert!((sums.h[(c, d)] - expected).abs() < 1e-9 * h.amax());
            }
        }
    }

    #[test]
    fn summing_does_not_depend_on_the_number_of_threads() {
        let model = embedded_model().unwrap();
        let body = Articulated::of_model(&model);
        let posed = body.posed(&turned(body.joint_count()), &model.mean_shape());
        let residuals = residuals(3000);
        let all = Unknowns { joints: vec![true; body.joint_count()], shape: true };
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| body.normal_equations(&posed, &residuals, &all))
        };
        let (one, four) = (with(1), with(4));
        assert!(one.h == four.h && one.g == four.g, "the same bits");
    }
}
