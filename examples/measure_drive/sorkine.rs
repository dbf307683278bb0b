//! The baseline of the paper's §4.3: Laplacian surface editing (Sorkine 2004). The transformation of each one-ring is a linear
//! function of the unknown points, so one system of `3V` unknowns couples the coordinates.

use nalgebra::{DMatrix, Matrix3, Matrix3xX};
use overcoat::body::{Figure, Pose};
use overcoat::drive::{DESCRIBED, Landmark};
use overcoat::geometry::{Adjacency, Point, Vec3};
use overcoat::numerics::SparseCholesky;
use std::collections::BTreeMap;

/// Radius of the patch of skin that a landmark holds, as in ours.
const PATCH: f64 = 0.04;
/// Its weight relative to a vertex, as in ours.
const STIFFNESS: f64 = 30.0;

pub struct Sorkine {
    factor: SparseCholesky,
    /// Vertices around each landmark.
    patches: Vec<Vec<usize>>,
    count: usize,
}

impl Sorkine {
    pub fn prepare(figure: &Figure) -> Self {
        let mesh = &figure.body().mesh;
        let rest: Vec<Vec3> = mesh.points().iter().map(|p| p.coords).collect();
        let adjacency = Adjacency::prepare(mesh);
        let mut entries: BTreeMap<(usize, usize), f64> = BTreeMap::new();
        for v in mesh.vertex_ids() {
            let neighbours: Vec<usize> = adjacency.neighbours_of(v).iter().map(|n| n.index()).collect();
            let ring: Vec<usize> = std::iter::once(v.index()).chain(neighbours.iter().copied()).collect();
            let offset: Vec3 = neighbours.iter().map(|&n| rest[v.index()] - rest[n]).sum();
            // (s, h, t) = (AᵀA)⁻¹Aᵀ b, b: the ring's points; relative to its centre, which t takes up.
            let a = DMatrix::from_fn(3 * ring.len(), 7, |row, column| {
                if column >= 4 {
                    f64::from(u8::from(row % 3 == column - 4))
                } else {
                    scale_and_turn(&(rest[ring[row / 3]] - rest[v.index()]))[(row % 3, column)]
                }
            });
            let Some(inverse) = (a.transpose() * &a + DMatrix::identity(7, 7) * 1e-14).try_inverse() else { continue };
            let solve = inverse * a.transpose();
            let turned = scale_and_turn(&offset) * solve.rows(0, 4);
            // L x − T δ, as rows over the ring.
            let rows = Matrix3xX::from_fn(3 * ring.len(), |row, column| {
                let of_laplacian = match (column % 3 == row, column < 3) {
                    (false, _) => 0.0,
                    (true, true) => neighbours.len() as f64,
                    (true, false) => -1.0,
                };
                of_laplacian - turned[(row, column)]
            });
            let product = rows.transpose() * &rows;
            for (i, &p) in ring.iter().enumerate() {
                for (j, &q) in ring.iter().enumerate() {
                    for (x, y) in (0..3).flat_map(|x| (0..3).map(move |y| (x, y))) {
                        *entries.entry((3 * p + x, 3 * q + y)).or_default() += product[(3 * i + x, 3 * j + y)];
                    }
                }
            }
        }
        let bind = figure.skeleton.joints_in_world(&Pose::bind(figure.skeleton.len()));
        let near = |landmark: &Landmark| {
            let at = bind[figure.skeleton.find(landmark.joint())?.index()];
            let nearest = rest.iter().min_by(|a, b| (*a - at.coords).norm().total_cmp(&(*b - at.coords).norm()))?;
            Some((0..rest.len()).filter(|&v| (rest[v] - nearest).norm() < PATCH).collect::<Vec<usize>>())
        };
        let patches: Vec<Vec<usize>> = Landmark::ALL[..DESCRIBED].iter().filter_map(near).collect();
        for patch in &patches {
            let share = STIFFNESS / patch.len() as f64;
            for axis in patch.iter().flat_map(|v| (0..3).map(move |axis| 3 * v + axis)) {
                *entries.entry((axis, axis)).or_default() += share;
            }
        }
        let triplets: Vec<(usize, usize, f64)> =
            entries.into_iter().map(|((i, j), x)| (i, j, if i == j { x + 1e-13 } else { x })).collect();
        let factor = SparseCholesky::prepare(3 * rest.len(), &triplets).expect("positive definite");
        Self { factor, patches, count: rest.len() }
    }

    /// The surface whose patches are where the true pose has them. That is more than a tracker tells: held at their centres only,
    /// as ours are, the surface between grows to many times its size, because the linear transformations may scale.
    pub fn solve(&self, figure: &Figure, pose: &Pose) -> Vec<Point> {
        let truth = figure.body().posed(&figure.skeleton, pose);
        let mut right = vec![0.0; 3 * self.count];
        for patch in &self.patches {
            let share = STIFFNESS / patch.len() as f64;
            for &v in patch {
                (0..3).for_each(|axis| right[3 * v + axis] += share * truth.points().as_slice()[v][axis]);
            }
        }
        self.factor.solve_in_place(&mut right);
        right.chunks_exact(3).map(|p| Point::new(p[0], p[1], p[2])).collect()
    }
}

/// `D` with `T x = D (s, h)`, without the translation.
fn scale_and_turn(x: &Vec3) -> nalgebra::Matrix3x4<f64> {
    let turn: Matrix3<f64> = Matrix3::new(0.0, x.z, -x.y, -x.z, 0.0, x.x, x.y, -x.x, 0.0);
    let mut d = nalgebra::Matrix3x4::zeros();
    d.set_column(0, x);
    d.fixed_view_mut::<3, 3>(0, 1).copy_from(&turn);
    d
}
