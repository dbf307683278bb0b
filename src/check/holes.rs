//! Holes: of a garment, and of a scan where it should show the body.

use crate::geometry::{Adjacency, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId};
use rayon::prelude::*;

/// The largest boundary loop that is not among `hems`: its area in m², and its rim. The area is half the length of the sum of the
/// cross products along the rim, which is the area of a flat hole, and less than that of a curved one.
///
/// **Shapes** `hems`: the vertices of each hem.
pub(super) fn largest_hole(mesh: &TriMesh, hems: &[Vec<VertexId>]) -> Option<(f64, Vec<Point>)> {
    let mut on_hem = PerVertex::filled(false, mesh.vertex_count());
    hems.iter().flatten().for_each(|&v| on_hem[v] = true);
    let loops = Adjacency::prepare(mesh).boundary_loops();
    let holes = loops.iter().filter(|rim| !rim.iter().all(|&v| on_hem[v]));
    let rims = holes.map(|rim| rim.iter().map(|&v| mesh.points()[v]).collect::<Vec<_>>());
    rims.map(|rim| (rim_area(&rim), rim)).max_by(|a, b| a.0.total_cmp(&b.0))
}

fn rim_area(rim: &[Point]) -> f64 {
    let Some(&first) = rim.first() else { return 0.0 };
    0.5 * rim.windows(2).map(|w| (w[0] - first).cross(&(w[1] - first))).sum::<Vec3>().norm()
}

/// Scan and body agree within this distance, in metres.
const SEEN_WITHIN: f64 = 0.025;
/// Least cosine between the normals of scan and body where the scan shows the body.
const LEAST_COSINE: f64 = 0.3;

/// The area in m² of the largest connected part of `body` that the scan does not show, and a vertex in it. Vertices for which
/// `ignored` holds are taken as seen.
pub(super) fn largest_unseen_part(
    body: &TriMesh,
    scan: &SurfaceIndex,
    ignored: impl Fn(VertexId) -> bool + Sync,
) -> Option<(f64, VertexId)> {
    let (areas, normals) = (body.vertex_areas(), body.vertex_normals_by_area());
    let unseen: PerVertex<bool> = body
        .vertex_ids()
        .collect::<Vec<_>>()
        .par_iter()
        .map(|&v| {
            let shown = scan.closest_within(&body.points()[v], SEEN_WITHIN);
            let faces = |face| scan.mesh().face_normal(face).dot(&normals[v]) > LEAST_COSINE;
            !ignored(v) && !shown.is_some_and(|at| faces(at.face))
        })
        .collect::<Vec<_>>()
        .into();
    let adjacency = Adjacency::prepare(body);
    let mut reached = PerVertex::filled(false, body.vertex_count());
    let mut largest: Option<(f64, VertexId)> = None;
    for start in body.vertex_ids().filter(|&v| unseen[v]) {
        if reached[start] {
            continue;
        }
        let (mut stack, mut area) = (vec![start], 0.0);
        reached[start] = true;
        while let Some(v) = stack.pop() {
            area += areas[v];
            for &next in adjacency.neighbours_of(v) {
                if unseen[next] && !reached[next] {
                    reached[next] = true;
                    stack.push(next);
                }
            }
        }
        if largest.is_none_or(|(most, _)| area > most) {
            largest = Some((area, start));
        }
    }
    largest
}
