//! Fairs boundary curves: smooths them, keeps them on the scan, and lets the cloth beside them follow.

use super::raggedness::{angles_of_faces, raggedness};
use crate::cut::holes::fill_holes::FilledScan;
use crate::cut::params::CutParams;
use crate::cut::slice::Slice;
use crate::geometry::{Adjacency, FaceId, PerFace, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId};
use rayon::prelude::*;

/// The two factors of Taubin (1995) along the curve: the second undoes the shrinkage caused by the first.
const SHRINK: f64 = 0.5;
const GROW: f64 = -0.52;
/// Rings of vertices beside a boundary that follow it. Four: about 2 cm, five times the move of a hem.
const RINGS: usize = 4;
/// Greatest move of a boundary along the scan, in metres: enough to smooth it, too little to redraw it.
const REACH: f64 = 0.03;

/// Number of rounds after which the cloth beside a boundary follows: few enough that no face flips.
const ROUNDS_PER_RELAXATION: usize = 8;
/// Number of rounds after which the boundary is projected back onto the scan: a round moves it by a fraction of a
/// millimetre.
const ROUNDS_PER_LANDING: usize = 2;
/// Final rounds without projection: they remove undulations under 2 cm.
const LAST_ROUNDS: usize = 12;

/// A boundary that is longer than its smoothed line by this factor is faired further, off the scan, which is crumpled there. Hems that look
/// smooth have at most 11 %.
pub(in crate::cut) const MOST_RAGGED: f64 = 1.08;
/// Greatest number of times that such a boundary is faired further, and the rounds of each.
const MOST_REPEATS: usize = 12;
const ROUNDS_PER_REPEAT: usize = 8;

/// A garment with fair boundaries.
pub(in crate::cut) struct Faired {
    pub(in crate::cut) mesh: TriMesh,
    pub(in crate::cut) adjacency: Adjacency,
    pub(in crate::cut) colors: Option<PerVertex<[u8; 3]>>,
    pub(in crate::cut) on_cut: Vec<bool>,
    pub(in crate::cut) is_seen: Vec<bool>,
}

/// Fairs every boundary loop of `slice` on the surface of the scan, whose adjacency is `around`.
pub(in crate::cut) fn faired(slice: Slice, scan: &FilledScan, around: &Adjacency, params: &CutParams) -> Faired {
    let adjacency = slice.adjacency().clone();
    let loops = adjacency.boundary_loops();
    let rings = rings_from(&slice.mesh, &adjacency, &loops);
    let near = near_surface(scan, around, &slice, &rings);
    let index = near.as_ref().map(|n| SurfaceIndex::prepare(&n.mesh));
    let mut points = slice.mesh.points().clone();
    let mut landed: PerVertex<Option<(FaceId, [f64; 3])>> = PerVertex::filled(None, points.len());
    if let Some(index) = &index {
        let beside: Vec<VertexId> = slice.mesh.vertex_ids().filter(|&v| (1..=RINGS).contains(&rings[v])).collect();
        let on_loops: Vec<VertexId> = loops.iter().flatten().copied().collect();
        for round in 1..=params.fairing_rounds {
            for factor in [SHRINK, GROW] {
                smooth_loops(&mut points, &loops, factor);
            }
            if round % ROUNDS_PER_LANDING == 0 {
                project(&on_loops, &mut points, &mut landed, index);
            }
            if round % ROUNDS_PER_RELAXATION == 0 {
                relax(&mut points, &adjacency, &beside);
                project(&beside, &mut points, &mut landed, index);
            }
        }
        // Last, the scan's grain along the curve is removed; the curve leaves the surface by no more than that grain.
        for _ in 0..LAST_ROUNDS {
            for factor in [SHRINK, GROW] {
                smooth_loops(&mut points, &loops, factor);
            }
        }
    }
    let points = without_crumbs(&slice.mesh, &adjacency, &loops, &rings, points);
    let colors = scan.colors.as_ref().map(|colors| {
        let at_scan = |parts: &[(VertexId, f64)]| {
            let mut sum = [0.0; 3];
            for &(v, factor) in parts {
                for (s, c) in sum.iter_mut().zip(colors[v]) {
                    *s += factor * f64::from(c);
                }
            }
            sum.map(|s| s.round().clamp(0.0, 255.0) as u8)
        };
        slice
            .mesh
            .vertex_ids()
            .map(|v| match (landed[v], &near) {
                (Some((face, weights)), Some(near)) => {
                    let corners = near.mesh.faces()[face];
                    let parts: [(VertexId, f64); 3] =
                        std::array::from_fn(|k| (near.scan_vertices[corners[k]], weights[k]));
                    at_scan(&parts)
                }
                _ => at_scan(&slice.origins[v.index()]),
            })
            .collect()
    });
    Faired { mesh: slice.mesh.with_points(points), adjacency, colors, on_cut: slice.on_cut, is_seen: slice.is_seen }
}

/// Fairs boundaries that are still ragged, with the cloth beside them, until they are not.
fn without_crumbs(
    mesh: &TriMesh,
    adjacency: &Adjacency,
    loops: &[Vec<VertexId>],
    rings: &PerVertex<usize>,
    mut points: PerVertex<Point>,
) -> PerVertex<Point> {
    for _ in 0..MOST_REPEATS {
        let now = mesh.with_points(points.clone());
        let angles = angles_of_faces(&now);
        let is_ragged = |hem: &&Vec<VertexId>| {
            raggedness(&now, &angles, hem, 0.0).is_some_and(|found| found.length_per_smooth_length > MOST_RAGGED)
        };
        let ragged: Vec<Vec<VertexId>> = loops.iter().filter(is_ragged).cloned().collect();
        if ragged.is_empty() {
            break;
        }
        let near = rings_from(mesh, adjacency, &ragged);
        let beside: Vec<VertexId> = mesh.vertex_ids().filter(|&v| near[v] <= RINGS && rings[v] > 0).collect();
        for _ in 0..ROUNDS_PER_REPEAT {
            for factor in [SHRINK, GROW] {
                smooth_loops(&mut points, &ragged, factor);
            }
        }
        relax(&mut points, adjacency, &beside);
    }
    points
}

/// Per vertex its distance from a boundary in edges, up to `RINGS` + 1.
fn rings_from(mesh: &TriMesh, adjacency: &Adjacency, loops: &[Vec<VertexId>]) -> PerVertex<usize> {
    let mut rings = PerVertex::filled(RINGS + 1, mesh.vertex_count());
    let mut front: Vec<VertexId> = loops.iter().flatten().copied().collect();
    for ring in 0..=RINGS {
        let mut next = Vec::new();
        for v in front {
            if ring < rings[v] {
                rings[v] = ring;
                next.extend_from_slice(adjacency.neighbours_of(v));
            }
        }
        front = next;
    }
    rings
}

/// The part of the scan on which a boundary may slide.
struct NearSurface {
    mesh: TriMesh,
    scan_vertices: PerVertex<VertexId>,
}

fn near_surface(
    scan: &FilledScan,
    adjacency: &Adjacency,
    slice: &Slice,
    rings: &PerVertex<usize>,
) -> Option<NearSurface> {
    let sources: Vec<(VertexId, f64)> = rings
        .enumerate()
        .filter(|&(_, &ring)| ring <= RINGS)
        .flat_map(|(v, _)| slice.origins[v.index()].map(|(origin, _)| (origin, 0.0)))
        .collect();
    let distance = crate::geometry::geodesic_distances(&scan.surface.mesh, adjacency, &sources, REACH);
    let keep: PerFace<bool> =
        scan.surface.mesh.faces().iter().map(|f| f.iter().any(|&v| distance[v].is_finite())).collect();
    let (mesh, scan_vertices) = scan.surface.mesh.part(&keep);
    (mesh.face_count() > 0).then_some(NearSurface { mesh, scan_vertices })
}

fn smooth_loops(points: &mut PerVertex<Point>, loops: &[Vec<VertexId>], factor: f64) {
    for ring in loops.iter().filter(|ring| ring.len() > 3) {
        let count = ring.len();
        let moves: Vec<Vec3> = (0..count)
            .map(|i| {
                let at = |k: usize| points[ring[k % count]];
                (nalgebra::center(&at(i + count - 1), &at(i + 1)) - at(i)) * factor
            })
            .collect();
        for (&v, by) in ring.iter().zip(moves) {
            points[v] += by;
        }
    }
}

/// Moves each vertex half-way to the mean of its neighbours.
fn relax(points: &mut PerVertex<Point>, adjacency: &Adjacency, beside: &[VertexId]) {
    let moved: Vec<Point> = beside
        .iter()
        .map(|&v| {
            let around = adjacency.neighbours_of(v);
            let sum: Vec3 = around.iter().map(|&w| points[w].coords).sum();
            nalgebra::center(&points[v], &Point::from(sum / around.len().max(1) as f64))
        })
        .collect();
    for (&v, p) in beside.iter().zip(moved) {
        points[v] = p;
    }
}

/// Projects vertices onto the surface if it is within reach.
fn project(
    vertices: &[VertexId],
    points: &mut PerVertex<Point>,
    landed: &mut PerVertex<Option<(FaceId, [f64; 3])>>,
    index: &SurfaceIndex,
) {
    let found: Vec<_> = vertices.par_iter().map(|&v| index.closest_within(&points[v], REACH)).collect();
    for (&v, found) in vertices.iter().zip(found) {
        if let Some(found) = found {
            points[v] = found.point;
            landed[v] = Some((found.face, found.barycentric));
        }
    }
}
