//! The body from landmarks by its Laplacian offsets: factorised once, solved for each frame.
//!
//! **Source** Lifkooee 2019, §3.1 and Eqs. 1–3, with these changes, each for a reason:
//! - `L` is not reduced by the rows of the landmarks: a lost landmark would change the matrix. `L + εM` is factorised once, and
//!   the landmarks come in by a small Schur complement (`c × c`), whichever of them are seen.
//! - A constraint on one vertex draws a spike; a landmark holds a patch of skin, softly.
//! - `F` of the template contains the template's own shape. The templates are this figure in other poses, and what is taken
//!   over is `R = F_pose · F_restᵀ`.
//! - A frame from one edge minimises nothing. The update is the rotation that fits the whole one-ring best (Procrustes; Sorkine
//!   and Alexa 2007), begun from the template's; by default the right-hand side takes the mean rotation of both ends of each
//!   edge, which is the minimum of that energy ([`RightSide::PerEdge`]). The paper's own is [`RightSide::PerVertex`].
//! - `b^c` is added with a positive sign: `L x = Δ` moves `−x_j` of a landmark to the right as `+x_j`.

use super::landmark::{LANDMARKS, Places};
use crate::body::{Figure, JointId, Pose, Skeleton, SkinWeights};
use crate::fit::Attached;
use crate::geometry::{Adjacency, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId, uniform_laplacian};
use crate::numerics::{NumericsError, SparseCholesky};
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, UnitQuaternion};
use rayon::prelude::*;

/// Radius of the patch of skin that a landmark holds, in metres: about the size of a sensor's strap.
const PATCH: f64 = 0.04;
/// Stiffness of a landmark's patch relative to an edge of the mesh.
const STIFFNESS: f64 = 30.0;
/// ε: weight of the mass matrix relative to an edge. It only makes the matrix positive definite; what it pulls to is the last
/// frame.
const EPSILON: f64 = 1e-5;

/// The right-hand side of the linear system.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RightSide {
    /// `Σ_j ½ (R_i + R_j)(x_i − x_j)`.
    #[default]
    PerEdge,
    /// `R_i Δ_i`: Eq. 3.
    PerVertex,
}

/// How the frames of the surface follow a solution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FrameUpdate {
    /// The skin of each joint turns as one: sixteen landmarks say nothing about the skin between them, which one-rings fill like
    /// rubber.
    #[default]
    PerJoint,
    /// Each one-ring for itself, as in the paper.
    PerRing,
}

/// A patch of skin below a landmark.
#[derive(Clone, Debug)]
struct Patch {
    /// Vertices and shares, which sum to 1.
    row: Vec<(usize, f64)>,
    /// From the patch's centre to the landmark, at rest.
    offset: Vec3,
}

/// The Laplacian of a body, factorised, with its landmarks.
pub struct LaplacianBody {
    rest: Vec<Vec3>,
    /// First entry of each vertex in `neighbours`, and the end.
    first: Vec<usize>,
    neighbours: Vec<usize>,
    /// `Δ = L x` at rest.
    offsets: Vec<Vec3>,
    factor: SparseCholesky,
    patches: Vec<Patch>,
    /// `(L + εM)⁻¹ Pᵀ`, column by column. **Shapes** `V × c`.
    influence: Vec<f64>,
    /// `P (L + εM)⁻¹ Pᵀ`. **Shapes** `c × c`.
    gram: DMatrix<f64>,
    right: RightSide,
    update: FrameUpdate,
    skeleton: Skeleton,
    weights: SkinWeights,
}

/// A body solved for a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Solved {
    /// The surface.
    pub points: PerVertex<Point>,
    /// Rotation of the surface around each vertex since the bind pose.
    pub rotations: Vec<Rotation3<f64>>,
    /// Iterations taken.
    pub iterations: usize,
    /// Greatest move of a vertex in the last iteration, in metres.
    pub moved: f64,
}

impl LaplacianBody {
    /// Factorises the body of a figure with attached landmarks.
    pub fn prepare(
        figure: &Figure,
        attached: &Attached,
        right: RightSide,
        update: FrameUpdate,
    ) -> Result<Self, NumericsError> {
        let body = figure.body();
        let mesh = &body.mesh;
        let count = mesh.vertex_count();
        let laplacian = uniform_laplacian(mesh);
        let mut triplets = laplacian.triplets.clone();
        triplets.extend((0..count).map(|v| (v, v, EPSILON)));
        let factor = SparseCholesky::prepare(count, &triplets)?;
        let rest: Vec<Vec3> = mesh.points().iter().map(|p| p.coords).collect();
        let adjacency = Adjacency::prepare(mesh);
        let (mut first, mut neighbours) = (vec![0], Vec::new());
        for v in mesh.vertex_ids() {
            neighbours.extend(adjacency.neighbours_of(v).iter().map(|n| n.index()));
            first.push(neighbours.len());
        }
        let offsets = laplacian.apply_to_vectors(&rest);
        let index = SurfaceIndex::prepare(mesh);
        let patches: Vec<Patch> = attached.points_in_bind.iter().map(|place| patch_at(mesh, &index, place)).collect();
        let mut influence = vec![0.0; count * patches.len()];
        for (column, patch) in influence.chunks_mut(count.max(1)).zip(&patches) {
            patch.row.iter().for_each(|&(v, share)| column[v] = share);
        }
        factor.solve_in_place(&mut influence);
        let gram = DMatrix::from_fn(patches.len(), patches.len(), |a, b| {
            patches[a].row.iter().map(|&(v, share)| share * influence[b * count + v]).sum()
        });
        let weights = body.weights.clone();
        Ok(Self {
            rest,
            first,
            neighbours,
            offsets,
            factor,
            patches,
            influence,
            gram,
            right,
            update,
            skeleton: figure.skeleton.clone(),
            weights,
        })
    }

    /// The number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.rest.len()
    }

    /// The rotations of the surface in a pose: those of its joints, blended.
    ///
    /// **Shapes** V.
    pub fn rotations_in(&self, figure: &Figure, pose: &Pose) -> Vec<Rotation3<f64>> {
        let of_joints: Vec<UnitQuaternion<f64>> =
            figure.skeleton.world_from_bind(pose).iter().map(|t| t.rotation).collect();
        self.blended(&of_joints)
    }

    /// Rotations of joints, blended by the skin weights. **Shapes** V.
    fn blended(&self, of_joints: &[UnitQuaternion<f64>]) -> Vec<Rotation3<f64>> {
        let blend = |row: &[(JointId, f64)]| {
            let lead = of_joints[row[0].0.index()].coords;
            let sum = row.iter().filter(|(_, w)| *w > 0.0).fold(nalgebra::Vector4::zeros(), |sum, &(j, w)| {
                let q = of_joints[j.index()].coords;
                sum + q * (w * if q.dot(&lead) < 0.0 { -1.0 } else { 1.0 })
            });
            UnitQuaternion::new_normalize(nalgebra::Quaternion::from(sum)).to_rotation_matrix()
        };
        self.weights.rows().0.par_iter().map(|row| blend(row)).collect()
    }

    /// Where a surface has its landmarks, up to their offsets from the skin.
    pub fn places_at(&self, points: &[Vec3]) -> Places {
        std::array::from_fn(|k| {
            let row = &self.patches.get(k)?.row;
            Some(Point::from(row.iter().map(|&(v, share)| points[v] * share).sum::<Vec3>()))
        })
    }

    /// Mean squared distance of a surface's landmarks from the places where they were seen, in square metres.
    pub fn misfit(&self, points: &[Vec3], rotations: &[Rotation3<f64>], seen: &Places) -> f64 {
        let off = |(patch, place): (&Patch, &Option<Point>)| {
            let at: Vec3 = patch.row.iter().map(|&(v, share)| (points[v] + rotations[v] * patch.offset) * share).sum();
            Some((place.as_ref()?.coords - at).norm_squared())
        };
        let all: Vec<f64> = self.patches.iter().zip(seen).filter_map(off).collect();
        all.iter().sum::<f64>() / all.len().max(1) as f64
    }

    /// Solves for the surface whose landmarks are at `places`, from rotations and points nearby.
    ///
    /// Ends when no vertex moves by more than `still` metres, or after `most` iterations.
    ///
    /// **Guarantees** equal arguments give equal bytes, whatever the number of threads.
    pub fn solve(
        &self,
        places: &Places,
        known: &[bool; LANDMARKS],
        start: &[Rotation3<f64>],
        guess: &[Vec3],
        most: usize,
        still: f64,
    ) -> Solved {
        let seen: Vec<(usize, Vec3)> = places
            .iter()
            .enumerate()
            .filter(|(k, _)| known[*k])
            .filter_map(|(k, place)| Some((k, place.as_ref()?.coords)))
            .collect();
        let c = seen.len();
        let compliance = DMatrix::from_fn(c, c, |a, b| {
            self.gram[(seen[a].0, seen[b].0)] + if a == b { 1.0 / STIFFNESS } else { 0.0 }
        });
        let small = compliance.cholesky();
        let mut rotations = start.to_vec();
        let mut points = guess.to_vec();
        let mut moved = f64::INFINITY;
        let mut iterations = 0;
        while iterations < most && moved > still {
            if iterations > 0 {
                rotations = match self.update {
                    FrameUpdate::PerRing => self.fitted_rotations(&points, &rotations),
                    FrameUpdate::PerJoint => self.rotations_by_joint(&self.skeleton, &points),
                };
            }
            let mut columns = self.right_side(&rotations, guess);
            let count = self.rest.len();
            columns.par_chunks_mut(count.max(1)).for_each(|column| self.factor.solve_in_place(column));
            if let Some(small) = &small {
                self.hold(&mut columns, &seen, &rotations, small);
            }
            let next: Vec<Vec3> =
                (0..count).map(|v| Vec3::new(columns[v], columns[count + v], columns[2 * count + v])).collect();
            moved = points.iter().zip(&next).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
            points = next;
            iterations += 1;
        }
        let points = points.into_iter().map(Point::from).collect();
        Solved { points, rotations, iterations, moved }
    }

    /// The right-hand side, coordinate by coordinate. **Shapes** `V × 3`, column by column.
    fn right_side(&self, rotations: &[Rotation3<f64>], guess: &[Vec3]) -> Vec<f64> {
        let of_vertex = |v: usize| -> Vec3 {
            let own = &rotations[v];
            let turned = match self.right {
                RightSide::PerVertex => own * self.offsets[v],
                RightSide::PerEdge => {
                    let mut sum = own * (self.offsets[v] * 0.5);
                    for &n in &self.neighbours[self.first[v]..self.first[v + 1]] {
                        sum += rotations[n] * ((self.rest[v] - self.rest[n]) * 0.5);
                    }
                    sum
                }
            };
            turned + guess[v] * EPSILON
        };
        let vectors: Vec<Vec3> = (0..self.rest.len()).into_par_iter().map(of_vertex).collect();
        (0..3).flat_map(|axis| vectors.iter().map(move |v| v[axis])).collect()
    }

    /// Adds the landmarks to a solution without them: `x − A⁻¹Pᵀ (W⁻¹ + PA⁻¹Pᵀ)⁻¹ (Px − u)`.
    fn hold(
        &self,
        columns: &mut [f64],
        seen: &[(usize, Vec3)],
        rotations: &[Rotation3<f64>],
        small: &nalgebra::Cholesky<f64, nalgebra::Dyn>,
    ) {
        let count = self.rest.len();
        let targets: Vec<Vec3> = seen
            .iter()
            .map(|&(k, place)| {
                let patch = &self.patches[k];
                let turned: Vec3 = patch.row.iter().map(|&(v, share)| rotations[v] * patch.offset * share).sum();
                place - turned
            })
            .collect();
        columns.par_chunks_mut(count.max(1)).enumerate().for_each(|(axis, column)| {
            let off = DVector::from_fn(seen.len(), |a, _| {
                let row = &self.patches[seen[a].0].row;
                row.iter().map(|&(v, share)| share * column[v]).sum::<f64>() - targets[a][axis]
            });
            let pull = small.solve(&off);
            for (a, &(k, _)) in seen.iter().enumerate() {
                let by = pull[a];
                let influence = &self.influence[k * count..(k + 1) * count];
                column.iter_mut().zip(influence).for_each(|(x, i)| *x -= by * i);
            }
        });
    }

    /// For each vertex the rotation that fits its one-ring best, begun from a rotation nearby.
    ///
    /// **Source** Müller 2016, a robust method to extract the rotational part of deformations.
    fn fitted_rotations(&self, points: &[Vec3], start: &[Rotation3<f64>]) -> Vec<Rotation3<f64>> {
        let of_vertex = |v: usize| {
            let mut a = Matrix3::zeros();
            for &n in &self.neighbours[self.first[v]..self.first[v + 1]] {
                a += (points[v] - points[n]) * (self.rest[v] - self.rest[n]).transpose();
            }
            nearest_rotation(&a, &start[v])
        };
        (0..points.len()).into_par_iter().map(of_vertex).collect()
    }

    /// The rotation of each joint's skin since the bind pose.
    ///
    /// **Shapes** one per joint.
    fn joint_rotations(&self, skeleton: &Skeleton, points: &[Vec3]) -> Vec<Rotation3<f64>> {
        let count = skeleton.len();
        let mut sums = vec![(0.0, Vec3::zeros(), Vec3::zeros(), Matrix3::zeros()); count];
        for ((row, p), rest) in self.weights.rows().iter().zip(points).zip(&self.rest) {
            // Only skin that clearly belongs to a joint: between two, it turns with neither.
            for &(j, w) in row.iter().filter(|(_, w)| *w > 0.5) {
                let sum = &mut sums[j.index()];
                sum.0 += w;
                sum.1 += rest * w;
                sum.2 += p * w;
                sum.3 += p * rest.transpose() * w;
            }
        }
        let mut rotations: Vec<Rotation3<f64>> = Vec::with_capacity(count);
        for j in skeleton.ids() {
            let above =
                skeleton.parents[j.index()].map_or_else(Rotation3::identity, |parent| rotations[parent.index()]);
            let (weight, rest, now, product) = &sums[j.index()];
            let own = match *weight > 0.0 {
                true => nearest_rotation(&(product - now * rest.transpose() / *weight), &above),
                false => above,
            };
            rotations.push(own);
        }
        rotations
    }

    /// The rotations of the skin where each joint's skin is rigid, blended by the skin weights.
    ///
    /// **Shapes** V.
    fn rotations_by_joint(&self, skeleton: &Skeleton, points: &[Vec3]) -> Vec<Rotation3<f64>> {
        let of_joints: Vec<UnitQuaternion<f64>> =
            self.joint_rotations(skeleton, points).iter().map(UnitQuaternion::from_rotation_matrix).collect();
        self.blended(&of_joints)
    }

    /// The pose whose skinning fits a surface best: each joint turns as the skin that follows it.
    pub fn pose_of(&self, figure: &Figure, points: &PerVertex<Point>) -> Pose {
        let skeleton = &figure.skeleton;
        let plain: Vec<Vec3> = points.iter().map(|p| p.coords).collect();
        let rotations = self.joint_rotations(skeleton, &plain);
        let mut pose = Pose::bind(skeleton.len());
        for j in skeleton.ids() {
            let own = rotations[j.index()];
            let local = skeleton.parents[j.index()].map_or(own, |parent| rotations[parent.index()].inverse() * own);
            pose.rotations[j.index()] = UnitQuaternion::from_rotation_matrix(&local);
        }
        let skinned = figure.body().posed(skeleton, &pose);
        let off: Vec3 = points.iter().zip(skinned.points().iter()).map(|(a, b)| a - b).sum();
        pose.translation += off / points.len().max(1) as f64;
        pose
    }
}

/// The rotation nearest to a matrix (the polar decomposition's), begun from one nearby.
fn nearest_rotation(a: &Matrix3<f64>, start: &Rotation3<f64>) -> Rotation3<f64> {
    /// Enough for half a turn; near the start two or three do.
    const STEPS: usize = 20;
    const STILL: f64 = 1e-6;
    let mut rotation = *start;
    for _ in 0..STEPS {
        let r = rotation.matrix();
        let (mut turn, mut along) = (Vec3::zeros(), 0.0);
        for k in 0..3 {
            turn += r.column(k).cross(&a.column(k));
            along += r.column(k).dot(&a.column(k));
        }
        let turn = turn / (along.abs() + 1e-12);
        rotation = Rotation3::new(turn) * rotation;
        if turn.norm_squared() < STILL * STILL {
            break;
        }
    }
    rotation
}

/// The skin around the point that is nearest to a place, fading to the patch's rim.
fn patch_at(mesh: &TriMesh, index: &SurfaceIndex, place: &Point) -> Patch {
    let at = index.closest(place).point;
    let share = |p: &Point| (1.0 - ((p - at).norm() / PATCH).powi(2)).max(0.0);
    let mut row: Vec<(usize, f64)> =
        mesh.points().iter().enumerate().map(|(v, p)| (v, share(p))).filter(|(_, s)| *s > 0.0).collect();
    if row.is_empty() {
        let nearest = index.closest(place).nearest_corner(mesh);
        row.push((nearest.index(), 1.0));
    }
    let sum: f64 = row.iter().map(|(_, s)| s).sum();
    row.iter_mut().for_each(|(_, s)| *s /= sum);
    let center: Vec3 = row.iter().map(|&(v, s)| mesh.points()[VertexId::from_index(v)].coords * s).sum();
    Patch { row, offset: place.coords - center }
}
