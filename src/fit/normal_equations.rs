//! The normal equations of a Gauss–Newton step, summed by the bones that a residual touches.

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

/// How a residual turns one bone: Σ w (x × n) and Σ w n over what the bone moves of it, and two zeros that fill the lanes.
pub(super) struct Wrench {
    pub(super) bone: usize,
    pub(super) values: [f64; WRENCH],
}

impl Wrench {
    #[inline(always)]
    pub(super) fn moment_and_force(&self) -> (Vec3, Vec3) {
        let [a, b, c, x, y, z, ..] = self.values;
        (Vec3::new(a, b, c), Vec3::new(x, y, z))
    }
}

/// Numbers of a wrench with its padding.
const WRENCH: usize = 8;

/// Sums over residuals, by the bones that they touch: a joint turns all bones below it about its centre, so that all of `H`
/// follows from these few. A chain of ten joints over a residual costs as much as the two bones at its end.
pub(super) struct Sums {
    bones: usize,
    components: usize,
    /// For bones a ≤ b, a · bones + b, where their block is, or `NONE`.
    place_of: Vec<u32>,
    /// (a, b) and Σ w wₐ wᵦᵀ, a row after the other.
    blocks: Vec<(usize, usize, [[f64; WRENCH]; 6])>,
    /// Bones × 6 × `padded(K)`.
    by_shape: Vec<f64>,
    by_gap: Vec<[f64; 6]>,
    /// K × `padded(K)`, a row after the other.
    shape: Vec<f64>,
    shape_by_gap: Vec<f64>,
}

/// Numbers that a processor multiplies at once.
const LANES: usize = 4;

/// So many that whole lanes are filled.
fn padded(components: usize) -> usize {
    components.next_multiple_of(LANES)
}

/// Adds `factor · from`.
#[inline(always)]
fn add_scaled(to: &mut [f64], from: &[f64], factor: f64) {
    for (to, from) in to.as_chunks_mut::<LANES>().0.iter_mut().zip(from.as_chunks::<LANES>().0) {
        // All are read before any is written: the compiler then takes them together.
        *to = std::array::from_fn(|k| to[k] + factor * from[k]);
    }
}

const NONE: u32 = u32::MAX;

impl Sums {
    pub(super) fn zero(bones: usize, components: usize) -> Self {
        Self {
            bones,
            components,
            place_of: vec![NONE; bones * bones],
            blocks: Vec::new(),
            by_shape: vec![0.0; bones * 6 * padded(components)],
            by_gap: vec![[0.0; 6]; bones],
            shape: vec![0.0; components * padded(components)],
            shape_by_gap: vec![0.0; components],
        }
    }

    /// Numbers of a padded shape.
    pub(super) fn shape_width(&self) -> usize {
        padded(self.components)
    }

    #[inline(always)]
    fn block(&mut self, a: usize, b: usize) -> &mut [[f64; WRENCH]; 6] {
        let place = &mut self.place_of[a * self.bones + b];
        if *place == NONE {
            *place = self.blocks.len() as u32;
            self.blocks.push((a, b, [[0.0; WRENCH]; 6]));
        }
        &mut self.blocks[*place as usize].2
    }

    /// Adds a residual; `wrenches` are of different bones, `shape` is padded.
    #[inline(always)]
    pub(super) fn add(&mut self, wrenches: &[Wrench], shape: &[f64], gap: f64, weight: f64) {
        let width = padded(self.components);
        for (k, one) in wrenches.iter().enumerate() {
            let weighed = one.values.map(|x| x * weight);
            for other in &wrenches[k..] {
                let is_in_order = one.bone <= other.bone;
                let (a, b) = if is_in_order { (one.bone, other.bone) } else { (other.bone, one.bone) };
                let (rows, columns) = if is_in_order { (weighed, other.values) } else { (other.values, weighed) };
                for (slots, row) in self.block(a, b).iter_mut().zip(rows) {
                    add_scaled(slots, &columns, row);
                }
            }
            for (slot, x) in self.by_gap[one.bone].iter_mut().zip(&weighed) {
                *slot += x * gap;
            }
            if width > 0 {
                let first = one.bone * 6 * width;
                let rows = self.by_shape[first..first + 6 * width].chunks_exact_mut(width);
                for (slots, x) in rows.zip(&weighed) {
                    add_scaled(slots, shape, *x);
                }
            }
        }
        if width == 0 {
            return;
        }
        for (m, slots) in self.shape.chunks_exact_mut(width).enumerate() {
            let wx = weight * shape[m];
            self.shape_by_gap[m] += wx * gap;
            let first = m / LANES * LANES;
            add_scaled(&mut slots[first..], &shape[first..], wx);
        }
    }

    pub(super) fn merge(&mut self, other: &Self) {
        fn add(to: &mut [f64], from: &[f64]) {
            to.iter_mut().zip(from).for_each(|(a, b)| *a += b);
        }
        for (a, b, block) in &other.blocks {
            add(self.block(*a, *b).as_flattened_mut(), block.as_flattened());
        }
        add(&mut self.by_shape, &other.by_shape);
        self.by_gap.iter_mut().zip(&other.by_gap).for_each(|(a, b)| add(a, b));
        add(&mut self.shape, &other.shape);
        add(&mut self.shape_by_gap, &other.shape_by_gap);
    }

    /// The whole of `H` and `g`, for so many columns: those of what is held are zero.
    pub(super) fn equations(self, posed: &Posed, unknowns: &Unknowns, columns: usize) -> NormalEquations {
        let (bones, components) = (self.bones, self.components);
        let width = padded(components);
        let parents = &posed.skeleton.parents;
        // Row and column 0 are all bones together, row `1 + j` what hangs below joint `j`.
        let size = bones + 1;
        let mut all = vec![[0.0; 36]; size * size];
        for (a, b, block) in &self.blocks {
            all[(1 + a) * size + 1 + b] = std::array::from_fn(|i| block[i / 6][i % 6]);
            if a != b {
                all[(1 + b) * size + 1 + a] = std::array::from_fn(|i| block[i % 6][i / 6]);
            }
        }
        let mut by_shape = vec![0.0; size * 6 * width];
        by_shape[6 * width..].copy_from_slice(&self.by_shape);
        let mut by_gap = vec![[0.0; 6]; size];
        by_gap[1..].copy_from_slice(&self.by_gap);
        // A parent comes before its children.
        for j in (0..bones).rev() {
            let (from, to) = (1 + j, parents[j].map_or(0, |p| 1 + p.index()));
            for b in 0..size {
                let block = all[from * size + b];
                all[to * size + b].iter_mut().zip(&block).for_each(|(x, y)| *x += y);
            }
            let (head, tail) = by_shape.split_at_mut(from * 6 * width);
            head[to * 6 * width..(to + 1) * 6 * width].iter_mut().zip(tail).for_each(|(x, y)| *x += *y);
            let gap = by_gap[from];
            by_gap[to].iter_mut().zip(&gap).for_each(|(x, y)| *x += y);
        }
        for j in (0..bones).rev() {
            let (from, to) = (1 + j, parents[j].map_or(0, |p| 1 + p.index()));
            for a in 0..size {
                let block = all[a * size + from];
                all[a * size + to].iter_mut().zip(&block).for_each(|(x, y)| *x += y);
            }
        }
        let is_free = |a: usize| a == 0 || unknowns.joints[a - 1];
        // A translation moves by the force alone, a turn about `c` by the moment less `c` × force.
        let moved = |a: usize, wrench: &[f64; 6]| -> Vec3 {
            let (moment, force) =
                (Vec3::new(wrench[0], wrench[1], wrench[2]), Vec3::new(wrench[3], wrench[4], wrench[5]));
            if a == 0 { force } else { moment - posed.joints_in_world[a - 1].coords.cross(&force) }
        };
        let first = 3 * size;
        let mut h = DMatrix::zeros(columns, columns);
        let mut g = DVector::zeros(columns);
        for a in (0..size).filter(|&a| is_free(a)) {
            for b in (a..size).filter(|&b| is_free(b)) {
                let block = &all[a * size + b];
                let by_column: [Vec3; 6] =
                    std::array::from_fn(|c| moved(a, &std::array::from_fn(|r| block[6 * r + c])));
                for r in 0..3 {
                    let row = moved(b, &by_column.map(|column| column[r]));
                    (0..3).for_each(|c| h[(3 * a + r, 3 * b + c)] = row[c]);
                }
            }
            for m in 0..components {
                let column = std::array::from_fn(|r| by_shape[(a * 6 + r) * width + m]);
                let by_component = moved(a, &column);
                (0..3).for_each(|r| h[(3 * a + r, first + m)] = by_component[r]);
            }
            let pull = moved(a, &by_gap[a]);
            (0..3).for_each(|r| g[3 * a + r] = pull[r]);
        }
        for m in 0..components {
            for k in m..components {
                h[(first + m, first + k)] = self.shape[m * width + k];
            }
            g[first + m] = self.shape_by_gap[m];
        }
        h.fill_lower_triangle_with_upper_triangle();
        NormalEquations { h, g }
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
