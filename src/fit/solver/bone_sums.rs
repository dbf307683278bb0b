//! Sums over residuals per pair of bones, from which the normal equations follow.

use super::normal_equations::{NormalEquations, Unknowns};
use super::posed::Posed;
use crate::geometry::Vec3;
use nalgebra::{DMatrix, DVector};

/// Derivative of a residual by one bone: Σ w (x × n) and Σ w n over the points that the bone moves, padded with two zeros to whole lanes.
pub(crate) struct Wrench {
    pub(crate) bone: usize,
    pub(crate) values: [f64; WRENCH],
}

impl Wrench {
    #[inline(always)]
    pub(crate) fn moment_and_force(&self) -> (Vec3, Vec3) {
        let [a, b, c, x, y, z, ..] = self.values;
        (Vec3::new(a, b, c), Vec3::new(x, y, z))
    }
}

/// Length of a padded wrench.
const WRENCH: usize = 8;

/// Sums over residuals per pair of bones. A joint rotates all bones of its subtree about its centre, so that all of `H`
/// follows from these few sums: a residual below a chain of ten joints costs as much as the two bones at its end.
pub(crate) struct BoneSums {
    bones: usize,
    components: usize,
    /// For bones a ≤ b, at `a · bones + b`: the index of their block, or `NONE`.
    place_of: Vec<u32>,
    /// (a, b) and Σ w wₐ wᵦᵀ, row by row.
    blocks: Vec<(usize, usize, [[f64; WRENCH]; 6])>,
    /// **Shapes** bones × 6 × `padded(K)`.
    by_shape: Vec<f64>,
    by_gap: Vec<[f64; 6]>,
    /// **Shapes** K × `padded(K)`, row by row.
    shape: Vec<f64>,
    shape_by_gap: Vec<f64>,
}

/// Numbers that the processor multiplies at once.
const LANES: usize = 4;

/// The next multiple of whole lanes.
fn padded(components: usize) -> usize {
    components.next_multiple_of(LANES)
}

/// Adds `factor · from`.
#[inline(always)]
fn add_scaled(to: &mut [f64], from: &[f64], factor: f64) {
    for (to, from) in to.as_chunks_mut::<LANES>().0.iter_mut().zip(from.as_chunks::<LANES>().0) {
        // Reading all before writing any lets the compiler vectorise.
        *to = std::array::from_fn(|k| to[k] + factor * from[k]);
    }
}

const NONE: u32 = u32::MAX;

impl BoneSums {
    pub(crate) fn zero(bones: usize, components: usize) -> Self {
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

    /// Length of a padded row of shape derivatives.
    pub(crate) fn shape_width(&self) -> usize {
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

    /// Adds a residual; `wrenches` are those of different bones, `shape` is padded.
    #[inline(always)]
    pub(crate) fn add(&mut self, wrenches: &[Wrench], shape: &[f64], gap: f64, weight: f64) {
        let width = padded(self.components);
        for (k, one) in wrenches.iter().enumerate() {
            let weighted = one.values.map(|x| x * weight);
            for other in &wrenches[k..] {
                let is_in_order = one.bone <= other.bone;
                let (a, b) = if is_in_order { (one.bone, other.bone) } else { (other.bone, one.bone) };
                let (rows, columns) = if is_in_order { (weighted, other.values) } else { (other.values, weighted) };
                for (slots, row) in self.block(a, b).iter_mut().zip(rows) {
                    add_scaled(slots, &columns, row);
                }
            }
            for (slot, x) in self.by_gap[one.bone].iter_mut().zip(&weighted) {
                *slot += x * gap;
            }
            if width > 0 {
                let first = one.bone * 6 * width;
                let rows = self.by_shape[first..first + 6 * width].chunks_exact_mut(width);
                for (slots, x) in rows.zip(&weighted) {
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

    pub(crate) fn merge(&mut self, other: &Self) {
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

    /// `H` and `g` with `columns` columns; the columns of held joints are zero.
    pub(crate) fn equations(self, posed: &Posed, unknowns: &Unknowns, columns: usize) -> NormalEquations {
        let (bones, components) = (self.bones, self.components);
        let width = padded(components);
        let parents = &posed.skeleton.parents;
        // Row and column 0 are the sum of all bones, row `1 + j` the subtree of joint `j`.
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
        // The derivative by a translation is the force, by a rotation about `c` the moment minus `c` × force.
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
