//! A smooth displacement that brings every vertex clear.

use super::StackParams;
use super::displacement::Lack;
use super::obstacle::{Contact, Obstacle, concerns};
use crate::geometry::{Adjacency, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId, cotangent_laplacian};
use crate::numerics::{NumericsError, SparseCholesky};
use rayon::prelude::*;

/// Share of the clearance that cloth far inside comes to; cloth at the clearance keeps it, and what lies between keeps
/// its order. So scan noise about the surface is pressed flat instead of being thrown out as spikes.
const LEAST_CLEARANCE: f64 = 0.5;
/// Share of the clearance that every vertex must have in the end.
const ENOUGH: f64 = 0.25;
/// Rounds at each smoothing length. Each leaves about half of what the one before did.
const ROUNDS_PER_LENGTH: usize = 5;
/// Cosine between the normals of an inner vertex and the garment above which the one may press the other: not the far
/// side of a collar.
const FACING_COSINE: f64 = 0.2;

/// The garment's smoothing operators and what each vertex owes.
pub(super) struct Smoother<'a> {
    limbs: &'a PerVertex<[f64; 5]>,
    obstacles: &'a [Obstacle],
    params: &'a StackParams,
    mass: Vec<f64>,
    factors: Vec<SparseCholesky>,
    on_boundary: PerVertex<bool>,
    /// For each obstacle the height that each vertex must reach.
    owed: Vec<PerVertex<f64>>,
}

impl<'a> Smoother<'a> {
    pub(super) fn prepare(
        mesh: &TriMesh,
        limbs: &'a PerVertex<[f64; 5]>,
        obstacles: &'a [Obstacle],
        params: &'a StackParams,
    ) -> Result<Self, NumericsError> {
        let laplacian = cotangent_laplacian(mesh);
        let ones = vec![1.0; mesh.vertex_count()];
        let factors = params
            .smoothing_lengths
            .iter()
            .map(|length| SparseCholesky::prepare(ones.len(), &laplacian.screened(&ones, 0.0, length.powi(4))))
            .collect::<Result<_, _>>()?;
        let normals = mesh.vertex_normals();
        let owed = obstacles
            .iter()
            .map(|o| {
                (mesh.points().0.par_iter().enumerate())
                    .map(|(v, p)| {
                        o.contact(p, &normals.0[v], &limbs.0[v], params.clearance)
                            .map_or(ENOUGH * params.clearance, |c| height_after(c.height, params.clearance))
                    })
                    .collect::<Vec<_>>()
                    .into()
            })
            .collect();
        Ok(Self {
            limbs,
            obstacles,
            params,
            mass: laplacian.safe_mass(),
            factors,
            on_boundary: Adjacency::prepare(mesh).boundary_vertices(),
            owed,
        })
    }

    /// Moves the garment until all its vertices, and those of the inner layers under it, are on their side.
    pub(super) fn push_clear(&mut self, mesh: &TriMesh) -> TriMesh {
        let mut mesh = mesh.clone();
        for level in 0..self.factors.len() {
            for _ in 0..ROUNDS_PER_LENGTH {
                let lack = self.lack(&mesh);
                if lack.is_none() {
                    return mesh;
                }
                mesh = self.moved(&mesh, &lack, level);
            }
        }
        let lack = self.lack(&mesh);
        moved_by(&mesh, lack.moves())
    }

    /// What the garment's vertices, and the inner vertices that stick through it, still ask for.
    pub(super) fn lack(&self, mesh: &TriMesh) -> Lack {
        let mut lack = Lack::none(mesh.vertex_count());
        let normals = mesh.vertex_normals();
        for (obstacle, owed) in self.obstacles.iter().zip(&self.owed) {
            let asked: Vec<Option<Vec3>> = (mesh.points().0.par_iter().enumerate())
                .map(|(v, p)| {
                    let owed = owed.0[v];
                    let Contact { height, normal } = obstacle.contact(p, &normals.0[v], &self.limbs.0[v], owed)?;
                    (height < owed * (1.0 - 1e-6)).then(|| normal * (owed - height))
                })
                .collect();
            for (v, wanted) in asked.into_iter().enumerate() {
                if let Some(wanted) = wanted {
                    lack.ask(VertexId::from_index(v), wanted);
                }
            }
        }
        self.ask_for_inner_vertices(mesh, &mut lack);
        lack
    }

    /// Inner vertices outside the garment's triangles push the corners of these.
    fn ask_for_inner_vertices(&self, mesh: &TriMesh, lack: &mut Lack) {
        let garment = SurfaceIndex::prepare(mesh);
        let enough = ENOUGH * self.params.clearance;
        for obstacle in self.obstacles {
            let inner = obstacle.index.mesh();
            let asked: Vec<Option<[(VertexId, Vec3); 3]>> = (inner.points().0.par_iter().enumerate())
                .map(|(v, p)| {
                    let at = garment.closest_within(p, self.params.greatest_depth)?;
                    let corners = mesh.faces()[at.face];
                    let border = (0..3).all(|k| at.barycentric[k] == 0.0 || self.on_boundary[corners[k]]);
                    let out = garment.pseudonormal(&at);
                    let height = if (p - at.point).dot(&out) > 0.0 { at.distance } else { -at.distance };
                    let nearest = (0..3).max_by(|&a, &b| at.barycentric[a].total_cmp(&at.barycentric[b]))?;
                    let is_own = concerns(&self.limbs[corners[nearest]], &obstacle.limbs.0[v]);
                    let faces = out.dot(&obstacle.vertex_normals.0[v]) > FACING_COSINE;
                    if height <= -enough || !is_own || !faces || (border && at.barycentric.contains(&0.0)) {
                        return None;
                    }
                    let squares: f64 = at.barycentric.iter().map(|b| b * b).sum();
                    let push = obstacle.vertex_normals.0[v] * ((height + enough) / squares);
                    Some([0, 1, 2].map(|k| (corners[k], push * at.barycentric[k])))
                })
                .collect();
            for (v, wanted) in asked.into_iter().flatten().flatten() {
                lack.ask(v, wanted);
            }
        }
    }

    /// The garment after the smooth displacement closest to what it lacks, at one of the smoothing lengths.
    pub(super) fn moved(&self, mesh: &TriMesh, lack: &Lack, level: usize) -> TriMesh {
        let Some(factor) = self.factors.get(level) else { return moved_by(mesh, lack.moves()) };
        let right: Vec<Vec3> = lack.moves().iter().zip(&self.mass).map(|(u, m)| u * *m).collect();
        moved_by(mesh, &factor.solve_vectors(&right).into())
    }

    /// The narrowest smoothing.
    pub(super) fn last_level(&self) -> usize {
        self.factors.len().saturating_sub(1)
    }
}

/// Where cloth at `height` above the surface belongs: between half the clearance and all of it, in the same order.
fn height_after(height: f64, clearance: f64) -> f64 {
    if height >= clearance {
        return height;
    }
    clearance * (LEAST_CLEARANCE + (1.0 - LEAST_CLEARANCE) * ((height - clearance) / clearance).exp())
}

pub(super) fn moved_by(mesh: &TriMesh, moves: &PerVertex<Vec3>) -> TriMesh {
    mesh.with_points(mesh.points().iter().zip(moves.iter()).map(|(p, u)| p + u).collect::<Vec<Point>>())
}
