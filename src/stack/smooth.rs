//! A smooth displacement that moves every vertex clear.

use super::movable_region::MovableRegion;
use super::obstacle::{Clearance, Obstacle, concerns};
use super::params::StackParams;
use super::required_moves::RequiredMoves;
use crate::geometry::{
    Adjacency, Laplacian, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId, cotangent_laplacian,
};
use crate::numerics::NumericsError;
use rayon::prelude::*;

/// Share of the clearance at which cloth from far inside ends. Cloth at the clearance stays, and heights in between keep
/// their order, so scan noise around the surface is flattened instead of becoming spikes.
const LEAST_CLEARANCE: f64 = 0.5;
/// An inner vertex farther than this outside the garment, in metres, does not penetrate it but is past its border, as a
/// hand is past the cuff. The garment's own vertices find cloth that deep inside.
const FARTHEST_POKE: f64 = 0.02;
/// Greatest height above a layer at which a vertex is checked, in metres: more than smoothing moves any vertex inwards.
const NEAR: f64 = 0.02;
/// Tolerated shortfall as a share of the required height: a thousandth of the cloth's thickness.
const TOLERANCE: f64 = 1e-3;
/// Share of the clearance that every vertex must keep.
const ENOUGH: f64 = 0.25;
/// Rounds at each smoothing length. Each round halves the remaining violations.
const ROUNDS_PER_LENGTH: usize = 5;
/// Cosine between the normals of an inner vertex and the garment above which the vertex may push the garment; it excludes
/// the far side of a collar.
const FACING_COSINE: f64 = 0.2;

/// The garment's smoothing operators and the height required of each vertex.
pub(super) struct Smoother<'a> {
    limbs: &'a PerVertex<[f64; 5]>,
    obstacles: &'a [Obstacle],
    params: &'a StackParams,
    laplacian: Laplacian,
    adjacency: Adjacency,
    mean_edge_length: f64,
    on_boundary: PerVertex<bool>,
    /// Per obstacle the garment vertices that are or may come near it, with the height each must reach, in metres.
    required_heights: Vec<Vec<(VertexId, f64)>>,
    /// Per obstacle its vertices that are or may come near the garment.
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
        let required_heights = obstacles
            .iter()
            .map(|o| {
                let near = |v: VertexId, p: &Point| {
                    let clearance = o.clearance_of(p, &normals[v], &limbs[v], NEAR)?;
                    let is_close = clearance.height < params.clearance;
                    let after = if is_close {
                        height_after(clearance.height, params.clearance)
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
            required_heights,
            inner,
        }
    }

    /// Moves the garment until its vertices are outside all layers and no inner vertex penetrates it.
    pub(super) fn push_clear(&self, mesh: &TriMesh) -> Result<TriMesh, NumericsError> {
        let mut mesh = mesh.clone();
        let mut required = self.required_moves(&mesh, None);
        for (level, &length) in self.params.smoothing_lengths.iter().enumerate() {
            if level == 0 || level + 1 == self.params.smoothing_lengths.len() {
                self.require_room_for_inner_vertices(&mesh, &mut required);
            }
            if required.is_empty() {
                return Ok(mesh);
            }
            let region = self.region(&required, length)?;
            for _ in 0..ROUNDS_PER_LENGTH {
                mesh = moved_by(&mesh, &region.smoothed(&required));
                required = self.required_moves(&mesh, Some(&region));
                if required.is_empty() {
                    break;
                }
            }
        }
        Ok(moved_by(&mesh, required.moves()))
    }

    /// The moves that the garment's vertices still need, or only those of the region that has just moved.
    pub(super) fn required_moves(&self, mesh: &TriMesh, region: Option<&MovableRegion>) -> RequiredMoves {
        self.required_below(mesh, region, f64::INFINITY)
    }

    /// The moves that vertices inside some layer still need.
    pub(super) fn required_of_inside_vertices(&self, mesh: &TriMesh) -> RequiredMoves {
        self.required_below(mesh, None, 0.0)
    }

    fn required_below(&self, mesh: &TriMesh, region: Option<&MovableRegion>, greatest_height: f64) -> RequiredMoves {
        let mut required = RequiredMoves::none(mesh.vertex_count());
        let normals = mesh.vertex_normals();
        for (obstacle, heights) in self.obstacles.iter().zip(&self.required_heights) {
            let wanted: Vec<Option<Vec3>> = heights
                .par_iter()
                .map(|&(v, required_height)| {
                    if region.is_some_and(|r| !r.has(v)) {
                        return None;
                    }
                    let reach = required_height.min(greatest_height);
                    let clearance = obstacle.clearance_of(&mesh.points()[v], &normals[v], &self.limbs[v], reach)?;
                    let Clearance { height, normal } = clearance;
                    (height < required_height * (1.0 - TOLERANCE)).then(|| normal * (required_height - height))
                })
                .collect();
            for (&(v, _), wanted) in heights.iter().zip(wanted) {
                if let Some(wanted) = wanted {
                    required.require(v, wanted);
                }
            }
        }
        required
    }

    /// Adds the moves by which inner vertices outside the garment push the corners of its triangles.
    fn require_room_for_inner_vertices(&self, mesh: &TriMesh, required: &mut RequiredMoves) {
        let garment = SurfaceIndex::prepare(mesh);
        let enough = ENOUGH * self.params.clearance;
        for (obstacle, inner) in self.obstacles.iter().zip(&self.inner) {
            let wanted: Vec<Option<[(VertexId, Vec3); 3]>> = inner
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
            for (v, wanted) in wanted.into_iter().flatten().flatten() {
                required.require(v, wanted);
            }
        }
    }

    /// The region that may move, and its smoothing operator for that length.
    pub(super) fn region(&self, required: &RequiredMoves, length: f64) -> Result<MovableRegion, NumericsError> {
        MovableRegion::around(required, length, &self.laplacian, &self.adjacency, self.mean_edge_length)
    }
}

/// The results of `f` for the vertices that it accepts, in vertex order.
fn select<T: Send>(points: &PerVertex<Point>, f: impl Fn(VertexId, &Point) -> Option<T> + Sync) -> Vec<T> {
    let found: Vec<Option<T>> = (points.0.par_iter().enumerate()).map(|(i, p)| f(VertexId::from_index(i), p)).collect();
    found.into_iter().flatten().collect()
}

/// The height required of cloth now at `height`: between half the clearance and the whole of it, in the same order.
fn height_after(height: f64, clearance: f64) -> f64 {
    if height >= clearance {
        return height;
    }
    clearance * (LEAST_CLEARANCE + (1.0 - LEAST_CLEARANCE) * ((height - clearance) / clearance).exp())
}

pub(super) fn moved_by(mesh: &TriMesh, moves: &PerVertex<Vec3>) -> TriMesh {
    mesh.with_points(mesh.points().iter().zip(moves.iter()).map(|(p, u)| p + u).collect::<Vec<Point>>())
}
