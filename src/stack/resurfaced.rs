//! Replaces the part of a garment that no smoothing unfolds: a flap folded onto itself, a tunnel as thin as a thread.

use crate::geometry::{Adjacency, FaceId, PerFace, Point, TriMesh, VertexId, least_area_faces};

/// Greatest number of vertices of a ring that is closed: a part larger than a hand is not replaced.
const GREATEST_RING: usize = 200;
/// Pieces with fewer faces that come off with the part are dropped with it.
const LEAST_PIECE: usize = 60;

/// The garment without the faces within `rings` rings of `bad`, and the rings that this opens closed with as little area as
/// possible. Where the part reaches the border of the garment, the border runs around it.
///
/// **Guarantees** vertices and their order stay; those of the removed part that no new face uses have no faces.
///
/// `None` if a ring is too long to be closed.
pub(super) fn resurfaced(mesh: &TriMesh, bad: &[FaceId], rings: usize) -> Option<TriMesh> {
    let adjacency = Adjacency::prepare(mesh);
    let mut removed: PerFace<bool> = PerFace::filled(false, mesh.face_count());
    bad.iter().for_each(|&f| removed[f] = true);
    for _ in 0..rings {
        let front: Vec<FaceId> = mesh.face_ids().filter(|&f| removed[f]).collect();
        for v in front.iter().flat_map(|&f| mesh.faces()[f]) {
            adjacency.faces_of(v).iter().for_each(|&f| removed[f] = true);
        }
    }
    let mut kept = faces_where(mesh, |f| !removed[f]);
    let (piece, count) = Adjacency::prepare(&mesh.with_faces(kept.clone())).face_components();
    let mut sizes = vec![0; count];
    piece.iter().for_each(|&p| sizes[p as usize] += 1);
    let (whole, whole_count) = adjacency.face_components();
    // A small piece that was part of a larger one came off; small pieces that were always apart stay.
    let mut whole_sizes = vec![0; whole_count];
    whole.iter().for_each(|&w| whole_sizes[w as usize] += 1);
    let of_kept: Vec<usize> =
        mesh.face_ids().filter(|&f| !removed[f]).map(|f| whole_sizes[whole[f] as usize]).collect();
    let stays = |k: usize| {
        let size = sizes[piece.as_slice()[k] as usize];
        size >= LEAST_PIECE || size == of_kept[k]
    };
    kept = kept.iter().enumerate().filter(|&(k, _)| stays(k)).map(|(_, face)| *face).collect();
    if kept.is_empty() {
        return None;
    }
    let open = mesh.with_faces(kept.clone());
    let around = Adjacency::prepare(&open);
    let was_border: std::collections::BTreeSet<[VertexId; 2]> = adjacency.boundary_edges().iter().copied().collect();
    let mut faces = kept;
    for ring in around.boundary_loops() {
        let edges = (0..ring.len()).map(|i| [ring[i], ring[(i + 1) % ring.len()]]);
        if edges.into_iter().any(|edge| was_border.contains(&edge)) {
            continue;
        }
        if ring.len() > GREATEST_RING {
            return None;
        }
        let points: Vec<Point> = ring.iter().map(|&v| mesh.points()[v]).collect();
        let is_neighbour = |i: usize, j: usize| around.neighbours_of(ring[i]).contains(&ring[j]);
        if let Some(patch) = least_area_faces(&points, &is_neighbour) {
            faces.extend(patch.into_iter().map(|corners| corners.map(|k| ring[k])));
        }
    }
    Some(mesh.with_faces(faces))
}

fn faces_where(mesh: &TriMesh, keep: impl Fn(FaceId) -> bool) -> Vec<[VertexId; 3]> {
    mesh.faces().enumerate().filter(|&(f, _)| keep(f)).map(|(_, corners)| *corners).collect()
}
