//! Faces that agree with their neighbours and look outwards.

use super::{Adjacency, FaceId, PerFace, TriMesh, Vec3, VertexId};
use std::collections::HashSet;

/// Orients faces consistently with their neighbours, and each piece outward.
///
/// Edges with three faces or more do not determine orientation and are not crossed.
///
/// Returns the number of flipped faces.
pub fn orient_outward(mesh: &TriMesh, adjacency: &Adjacency) -> (TriMesh, usize) {
    let crowded = crowded_edges(mesh, adjacency);
    let mut turned = PerFace::filled(false, mesh.face_count());
    let mut piece_of = PerFace::filled(u32::MAX, mesh.face_count());
    let mut piece_count = 0;
    for seed in mesh.face_ids() {
        if piece_of[seed] != u32::MAX {
            continue;
        }
        let piece = piece_count as u32;
        piece_count += 1;
        piece_of[seed] = piece;
        let mut stack = vec![seed];
        while let Some(f) = stack.pop() {
            for (k, g) in adjacency.face_neighbours(f).into_iter().enumerate() {
                let Some(g) = g.filter(|&g| piece_of[g] == u32::MAX) else { continue };
                let (a, b) = (mesh.faces()[f][k], mesh.faces()[f][(k + 1) % 3]);
                if crowded.contains(&(a.min(b), a.max(b))) {
                    continue;
                }
                let same_sense = !runs_along(mesh, g, a, b);
                piece_of[g] = piece;
                turned[g] = if same_sense { turned[f] } else { !turned[f] };
                stack.push(g);
            }
        }
    }
    // Outward: the signed volume around the piece's own centre is positive, also for a piece with holes.
    let mut middle = vec![(Vec3::zeros(), 0.0); piece_count];
    for f in mesh.face_ids() {
        let (area, sum) = (mesh.face_area(f), &mut middle[piece_of[f] as usize]);
        let [a, b, c] = mesh.triangle(f).map(|p| p.coords);
        sum.0 += (a + b + c) * (area / 3.0);
        sum.1 += area;
    }
    let mut volume = vec![0.0; piece_count];
    for f in mesh.face_ids() {
        let (sum, area) = middle[piece_of[f] as usize];
        let [a, b, c] = mesh.triangle(f).map(|p| p.coords - sum / area);
        let part = a.dot(&b.cross(&c));
        volume[piece_of[f] as usize] += if turned[f] { -part } else { part };
    }
    let faces: Vec<[VertexId; 3]> = mesh
        .faces()
        .enumerate()
        .map(|(f, &[a, b, c])| {
            let turn = turned[f] != (volume[piece_of[f] as usize] < 0.0);
            turned[f] = turn;
            if turn { [a, c, b] } else { [a, b, c] }
        })
        .collect();
    let count = turned.iter().filter(|&&t| t).count();
    (mesh.with_faces(faces), count)
}

/// Edges with three faces or more.
fn crowded_edges(mesh: &TriMesh, adjacency: &Adjacency) -> HashSet<(VertexId, VertexId)> {
    let mut crowded = HashSet::new();
    for f in mesh.face_ids() {
        for (k, g) in adjacency.face_neighbours(f).into_iter().enumerate() {
            let Some(g) = g else { continue };
            // The first two faces of an edge are mutual neighbours; a further face refers to the first one only.
            let (a, b) = (mesh.faces()[f][k], mesh.faces()[f][(k + 1) % 3]);
            let side = (0..3).find(|&j| {
                let (c, d) = (mesh.faces()[g][j], mesh.faces()[g][(j + 1) % 3]);
                (c, d) == (a, b) || (c, d) == (b, a)
            });
            if side.is_some_and(|j| adjacency.face_neighbours(g)[j] != Some(f)) {
                crowded.insert((a.min(b), a.max(b)));
            }
        }
    }
    crowded
}

/// Whether face `f` has a side from `a` to `b` in this direction.
fn runs_along(mesh: &TriMesh, f: FaceId, a: VertexId, b: VertexId) -> bool {
    let face = mesh.faces()[f];
    (0..3).any(|k| face[k] == a && face[(k + 1) % 3] == b)
}
