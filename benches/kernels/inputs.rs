//! What the kernels are timed on: the embedded body in triangles of a quarter of the area, and made-up queries, labels and
//! programs. Everything is the same in each run.

#[path = "split_in_four.rs"]
mod split_in_four;

use nalgebra::{DMatrix, DVector, UnitQuaternion};
use overcoat::body::{Pose, Skeleton, SkinWeights, embedded_model};
use overcoat::geometry::{PerVertex, Point, TriMesh, Vec3, VertexId, uniform_laplacian};
use overcoat::numerics::{QpRow, QuadraticProgram};
use std::collections::BTreeMap;

pub use split_in_four::split_in_four;

/// Numbers that look random, between 0 and 1 (SplitMix64).
pub struct Chance(pub u64);

impl Chance {
    pub fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Between −1 and 1.
    pub fn signed(&mut self) -> f64 {
        2.0 * self.share() - 1.0
    }
}

/// The embedded body, each triangle split in four: about 30 000 vertices.
pub fn body() -> TriMesh {
    let Ok(model) = embedded_model() else { unreachable!("the embedded model is part of the program") };
    split_in_four(&model.template)
}

/// `count` vertices with four influences each, and a pose of all joints.
pub fn skinned(count: usize) -> (PerVertex<Point>, SkinWeights, Skeleton, Pose) {
    let Ok(model) = embedded_model() else { unreachable!("the embedded model is part of the program") };
    let of = |v: usize| VertexId::from_index(v % model.template.vertex_count());
    let points: Vec<Point> = (0..count).map(|v| model.template.points()[of(v)]).collect();
    let rows = (0..count).map(|v| model.weights.rows()[of(v)].to_vec());
    let mut pose = Pose::bind(model.skeleton.len());
    let turn = UnitQuaternion::from_euler_angles(0.1, 0.2, 0.1);
    pose.rotations.iter_mut().for_each(|rotation| *rotation = turn);
    (points.into(), SkinWeights::from_rows(rows), model.skeleton.clone(), pose)
}

/// Points up to 1 cm from vertices of the mesh in each direction.
pub fn queries(mesh: &TriMesh, count: usize) -> Vec<Point> {
    let mut chance = Chance(1);
    let points = mesh.points().as_slice();
    let mut query = || {
        let at = points[(chance.share() * points.len() as f64) as usize];
        at + Vec3::new(chance.signed(), chance.signed(), chance.signed()) * 0.01
    };
    (0..count).map(|_| query()).collect()
}

/// The uniform Laplacian plus a hundredth of the identity, as in the peers' scripts.
pub fn system(mesh: &TriMesh) -> Vec<(usize, usize, f64)> {
    let mut triplets = uniform_laplacian(mesh).triplets;
    triplets.extend((0..mesh.vertex_count()).map(|i| (i, i, 0.01)));
    triplets
}

/// Costs of the vertices and edges of a noisy segmentation: upper half against lower half.
pub fn labels(mesh: &TriMesh) -> (Vec<i64>, Vec<(u32, u32, i64)>) {
    let mut chance = Chance(2);
    let unary = mesh.points().iter().map(|p| (1000.0 * ((p.y - 1.0) * 4.0 + chance.signed() * 2.0)) as i64).collect();
    let mut edges = BTreeMap::new();
    for face in mesh.faces().iter() {
        let [a, b, c] = face.map(|v| v.0);
        for [i, j] in [[a, b], [b, c], [c, a]] {
            edges.entry([i.min(j), i.max(j)]).or_insert((200.0 + 800.0 * chance.share()) as i64);
        }
    }
    (unary, edges.into_iter().map(|([i, j], cost)| (i, j, cost)).collect())
}

/// A program of the size that the pose inside a scan solves in each step: 72 unknowns, 3000 bounds, few of them active.
pub fn program() -> QuadraticProgram {
    const UNKNOWNS: usize = 72;
    let mut chance = Chance(3);
    let jacobian = DMatrix::from_fn(300, UNKNOWNS, |_, _| chance.signed());
    let quadratic = jacobian.transpose() * &jacobian + DMatrix::identity(UNKNOWNS, UNKNOWNS);
    let linear = DVector::from_fn(UNKNOWNS, |_, _| 20.0 * chance.signed());
    let mut row = || QpRow {
        coefficients: (0..18).map(|k| (k * 4, chance.signed())).collect(),
        bound: 0.05 + 0.5 * chance.share(),
        slack_weight: Some(1e3),
    };
    let rows = (0..3000).map(|_| row()).collect();
    QuadraticProgram { quadratic, linear, rows }
}
