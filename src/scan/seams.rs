//! Surfaces whose parts nearly meet: seams that a program tore by rounding, and pieces that a scanner cut apart.

use super::pieces::{Pieces, Sound};
use crate::geometry::{Adjacency, NearestVertex, PerFace, PerVertex, Point, TriMesh, VertexId};
use std::collections::HashMap;

/// Distance below which vertices of open borders are one, as a share of the longest side of the scan: 0.2 mm of an adult.
const SEAM: f64 = 1.2e-4;
/// The same as a share of the mean edge: dense scans have edges below a millimetre.
const SEAM_PER_EDGE: f64 = 0.25;
/// The main piece's share of the area below which the person may consist of pieces.
const MAIN_SHARE: f64 = 0.7;
/// Distance up to which the borders of two pieces face each other, as a share of the longest side: 7 cm of an adult.
const FACING: f64 = 0.04;
/// Least share of a piece's border that faces the person's: of a band between two others, each has half.
const FACING_SHARE: f64 = 0.3;

impl Sound {
    /// Merges vertices of open borders that are nearly at the same place, and says how far they were apart at most.
    pub(super) fn joined_at_borders(&self) -> (Self, f64) {
        let mesh = &self.mesh;
        let longest = mesh.bounds().map_or(0.0, |b| b.extent().amax());
        let reach = (SEAM * longest).min(SEAM_PER_EDGE * mesh.mean_edge_length());
        let is_border = Adjacency::prepare(mesh).boundary_vertices();
        let cell = |p: &Point| [p.x, p.y, p.z].map(|c| (c / reach.max(f64::MIN_POSITIVE)).floor() as i64);
        let mut kept: HashMap<[i64; 3], Vec<VertexId>> = HashMap::new();
        let mut widest = 0.0f64;
        let one: PerVertex<VertexId> = mesh
            .points()
            .enumerate()
            .map(|(v, p)| {
                if !is_border[v] {
                    return v;
                }
                let [x, y, z] = cell(p);
                let around = (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| [i, j, k])));
                let near = around
                    .filter_map(|[i, j, k]| kept.get(&[x.saturating_add(i), y.saturating_add(j), z.saturating_add(k)]));
                let distance = |u: &VertexId| (mesh.points()[*u] - p).norm();
                let nearest = near.flatten().map(|&u| (distance(&u), u)).min_by(|a, b| a.0.total_cmp(&b.0));
                match nearest.filter(|(distance, _)| *distance <= reach) {
                    Some((distance, u)) => {
                        widest = widest.max(distance);
                        u
                    }
                    None => {
                        kept.entry([x, y, z]).or_default().push(v);
                        v
                    }
                }
            })
            .collect();
        let faces: Vec<[VertexId; 3]> = mesh.faces().iter().map(|face| face.map(|v| one[v])).collect();
        let all = PerFace::filled(true, faces.len());
        (Self { mesh: mesh.with_faces(faces), ..self.clone() }.part(&all), widest)
    }
}

impl Pieces {
    /// Adds the pieces to the person whose open borders run along its own, such as the bands and limbs that a scanner cuts
    /// apart. Other people have no such borders.
    pub(super) fn join_along_borders(&mut self, mesh: &TriMesh) {
        if self.main_share() >= MAIN_SHARE {
            return;
        }
        let adjacency = Adjacency::prepare(mesh);
        let Some(reach) = mesh.bounds().map(|b| FACING * b.extent().amax()) else { return };
        let mut of_piece: Vec<Vec<Point>> = vec![Vec::new(); self.list.len()];
        let place = self.places();
        for v in adjacency.boundary_edges().iter().flatten() {
            let piece = adjacency.faces_of(*v).first().and_then(|&f| place.get(&self.component_of(f)));
            if let Some(&piece) = piece {
                of_piece[piece].push(mesh.points()[*v]);
            }
        }
        loop {
            let person: Vec<Point> = (of_piece.iter().zip(&self.list))
                .filter(|(_, p)| p.is_of_person)
                .flat_map(|(b, _)| b)
                .copied()
                .collect();
            let nearest = NearestVertex::prepare(&person);
            let faces_person = |p: &&Point| nearest.nearest(p).is_some_and(|(_, distance)| distance <= reach);
            let mut has_grown = false;
            for (piece, border) in self.list.iter_mut().zip(&of_piece) {
                let facing = || border.iter().filter(faces_person).count() as f64;
                if !piece.is_of_person && !border.is_empty() && facing() >= FACING_SHARE * border.len() as f64 {
                    piece.is_of_person = true;
                    has_grown = true;
                }
            }
            if !has_grown {
                return;
            }
        }
    }
}
