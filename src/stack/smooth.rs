//! A smooth displacement that brings every vertex clear.

use super::StackParams;
use super::displacement::Lack;
use super::obstacle::{Contact, Obstacle, concerns};
use super::region::Region;
use crate::geometry::{
    Adjacency, Laplacian, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId, cotangent_laplacian,
};
use crate::numerics::NumericsError;
use rayon::prelude::*;

/// Share of the clearance that cloth far inside comes to; cloth at the clearance keeps it, and what lies between keeps
/// its order. So scan noise about the surface is pressed flat instead of being thrown out as spikes.
const LEAST_CLEARANCE: f64 = 0.5;
/// An inner vertex farther than this outside the garment, in metres, does not stick through it but lies beyond its border,
/// as a hand does before the cuff. Cloth that far inside is found by its own vertices.
const FARTHEST_POKE: f64 = 0.02;
/// Metres above a layer within which a vertex is watched: more than smoothing carries any vertex inwards.
const NEAR: f64 = 0.02;
/// Share of the height owed that may be missing: a thousandth of the cloth's thickness.
const TOLERANCE: f64 = 1e-3;
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
    laplacian: Laplacian,
    adjacency: Adjacency,
    mean_edge_length: f64,
    on_boundary: PerVertex<bool>,
    /// For each obstacle the vertices that are or may come near, and the height that each must reach.
    owed: Vec<Vec<(VertexId, f64)>>,
    /// For each obstacle its vertices that are or may come near the garment.
    inner: Vec<Vec<VertexId>>,
}

impl<'a> Smoother<'a> {
    pub(super) fn prepare(
        mesh: &TriMesh,
        limbs: &'a PerVertex<[f64; 5]>,
        obstacles: &'a [Obstacle],
        params: &'a StackParams,
    ) -> Self {
        let laplacian = cotangent_laplacian(mesh);
        let normals = mesh.vertex_normals();
        let garment = SurfaceIndex::prepare(mesh);
        let owed = obstacles
            .iter()
            .map(|o| {
                let near = |v: VertexId, p: &Point| {
                    let contact = o.contact(p, &normals[v], &limbs[v], NEAR)?;
                    let is_close = contact.height < params.clearance;
                    let after = if is_close {
                        height_after(contact.height, params.clearance)
                    } else {
                        ENOUGH * params.clearance
                    };
                    Some((v, after))
                };
                select(mesh.points(), near)
            })
            .collect();
        let inner = obstacles
            .iter()
            .map(|o| {
                let near = |v: VertexId, p: &Point| {
                    let at = garment.closest_within(p, FARTHEST_POKE)?;
                    let is_out = (p - at.point).dot(&garment.pseudonormal(&at)) > 0.0;
                    (is_out || at.distance < NEAR).then_some(v)
                };
                select(o.index.mesh().points(), near)
            })
            .collect();
        let adjacency = Adjacency::prepare(mesh);
        Self {
            limbs,
            obstacles,
            params,
            laplacian,
            on_boundary: adjacency.boundary_vertices(),
            mean_edge_length: mesh.mean_edge_length(),
            adjacency,
            owed,
            inner,
        }
    }

    /// Moves the garment until all its vertices, and those of the inner layers under it, are on their side.
    pub(super) fn push_clear(&self, mesh: &TriMesh) -> Result<TriMesh, NumericsError> {
        let mut mesh = mesh.clone();
        let mut lack = self.lack(&mesh, None);
        for (level, &length) in self.params.smoothing_lengths.iter().enumerate() {
            if level == 0 || level + 1 == self.params.smoothing_lengths.len() {
                self.ask_for_inner_vertices(&mesh, &mut lack);
            }
            if lack.is_none() {
                return Ok(mesh);
            }
            let region = self.region(&lack, length)?;
            for _ in 0..ROUNDS_PER_LENGTH {
                mesh = moved_by(&mesh, &region.smoothed(&lack));
                lack = self.lack(&mesh, Some(&region));
                if lack.is_none() {
                    break;
                }
            }
        }
        Ok(moved_by(&mesh, lack.moves()))
    }

    /// What the garment's vertices, or those of the region that has just moved, still ask for.
    pub(super) fn lack(&self, mesh: &TriMesh, region: Option<&Region>) -> Lack {
        self.lack_below(mesh, region, f64::INFINITY)
    }

    /// The same for those only that are inside some layer.
    pub(super) fn lack_of_those_inside(&self, mesh: &TriMesh) -> Lack {
        self.lack_below(mesh, None, 0.0)
    }

    fn lack_below(&self, mesh: &TriMesh, region: Option<&Region>, greatest_height: f64) -> Lack {
        let mut lack = Lack::none(mesh.vertex_count());
        let normals = mesh.vertex_normals();
        for (obstacle, owed) in self.obstacles.iter().zip(&self.owed) {
            let asked: Vec<Option<Vec3>> = owed
                .par_iter()
                .map(|&(v, owed)| {
                    if region.is_some_and(|r| !r.has(v)) {
                        return None;
                    }
                    let reach = owed.min(greatest_height);
                    let contact = obstacle.contact(&mesh.points()[v], &normals[v], &self.limbs[v], reach)?;
                    let Contact { height, normal } = contact;
                    (height < owed * (1.0 - TOLERANCE)).then(|| normal * (owed - height))
                })
                .collect();
            for (&(v, _), wanted) in owed.iter().zip(asked) {
                if let Some(wanted) = wanted {
                    lack.ask(v, wanted);
                }
            }
        }
        lack
    }

    /// Inner vertices outside the garment's triangles push the corners of these.
    fn ask_for_inner_vertices(&self, mesh: &TriMesh, lack: &mut Lack) {
        let garment = SurfaceIndex::prepare(mesh);
        let enough = ENOUGH * self.params.clearance;
        for (obstacle, inner) in self.obstacles.iter().zip(&self.inner) {
            let asked: Vec<Option<[(VertexId, Vec3); 3]>> = inner
                .par_iter()
                .map(|&v| {
                    let p = &obstacle.index.mesh().points()[v];
                    let at = garment.closest_within(p, FARTHEST_POKE)?;
                    let corners = mesh.faces()[at.face];
                    let is_border = corners.iter().any(|&corner| self.on_boundary[corner]);
                    let out = garment.pseudonormal(&at);
                    let height = if (p - at.point).dot(&out) > 0.0 { at.distance } else { -at.distance };
                    let nearest = (0..3).max_by(|&a, &b| at.barycentric[a].total_cmp(&at.barycentric[b]))?;
                    let is_own = concerns(&self.limbs[corners[nearest]], &obstacle.limbs[v]);
                    let faces = out.dot(&obstacle.vertex_normals[v]) > FACING_COSINE;
                    if height <= -enough || !is_own || !faces || is_border {
                        return None;
                    }
                    let squares: f64 = at.barycentric.iter().map(|b| b * b).sum();
                    let push = obstacle.vertex_normals[v] * ((height + enough) / squares);
                    Some([0, 1, 2].map(|k| (corners[k], push * at.barycentric[k])))
                })
                .collect();
            for (v, wanted) in asked.into_iter().flatten().flatten() {
                lack.ask(v, wanted);
            }
        }
    }

    /// Where the garment may move for what it lacks, smoothly over that length.
    pub(super) fn region(&self, lack: &Lack, length: f64) -> Result<Region, NumericsError> {
        Region::around(lack, length, &self.laplacian, &self.adjacency, self.mean_edge_length)
    }
}

/// What `f` makes of the vertices that it takes, in their order.
fn select<T: Send>(points: &PerVertex<Point>, f: impl Fn(VertexId, &Point) -> Option<T> + Sync) -> Vec<T> {
    let found: Vec<Option<T>> = (points.0.par_iter().enumerate()).map(|(i, p)| f(VertexId::from_index(i), p)).collect();
    found.into_iter().flatten().collect()
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
