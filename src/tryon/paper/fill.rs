//! Watertight parts: the holes of each part filled, as its curve skeleton requires.
//!
//! **Source** Shi 2020, §5.1, which refers to a hole filling method without naming its criterion. Rings are spanned with the
//! least area (Liepa 2003); long ones, for which that takes too long, by a fan around their centre. A cap needs only to be closed
//! and about flat: the skeleton's ends are the rings' own centres, whatever the cap.

use super::reeb::GarmentPart;
use crate::geometry::{Adjacency, PerFace, PerVertex, Point, TriMesh, VertexId, least_area_faces};
use crate::tryon::rims::ring_center;

/// Longest ring, in vertices, that is spanned with the least area: its time grows with the cube, 1 ms at 120.
const LONGEST_RING: usize = 120;

/// A part of a garment with all its holes filled.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosedPart {
    /// Closed mesh: first the part's own vertices, then the centres of fans.
    pub mesh: TriMesh,
    /// The garment's vertices. **Shapes** one per own vertex of `mesh`.
    pub garment_vertex: PerVertex<VertexId>,
    /// The rings that were filled, in vertices of `mesh`, the most vertices first.
    pub rings: Vec<Vec<VertexId>>,
}

/// The faces of a part, with its holes filled; `None` if it has no faces.
///
/// A face belongs to the part of two of its corners; with three parts at its corners to the torso. Of several components the
/// largest is kept.
pub fn closed_part(garment: &TriMesh, part_of: &PerVertex<GarmentPart>, part: GarmentPart) -> Option<ClosedPart> {
    let of_face = |[a, b, c]: [GarmentPart; 3]| {
        if a == b || a == c {
            a
        } else if b == c {
            b
        } else {
            GarmentPart::Torso
        }
    };
    let keep: PerFace<bool> = garment.faces().iter().map(|f| of_face(f.map(|v| part_of[v])) == part).collect();
    let (whole, of_garment) = garment.part(&keep);
    let (component, count) = Adjacency::prepare(&whole).face_components();
    let (open, garment_vertex) = if count > 1 {
        let (largest, of_whole) = whole.part(&component.iter().map(|&c| c == 0).collect());
        (largest, of_whole.iter().map(|&v| of_garment[v]).collect())
    } else {
        (whole, of_garment)
    };
    (open.face_count() > 0).then(|| filled(&open, garment_vertex))
}

fn filled(open: &TriMesh, garment_vertex: PerVertex<VertexId>) -> ClosedPart {
    let adjacency = Adjacency::prepare(open);
    let rings = adjacency.boundary_loops();
    let mut points = open.points().0.clone();
    let mut faces = open.faces().0.clone();
    for ring in &rings {
        let at: Vec<Point> = ring.iter().map(|&v| open.points()[v]).collect();
        let taken = |i: usize, j: usize| adjacency.neighbours_of(ring[i]).contains(&ring[j]);
        let least = if ring.len() <= LONGEST_RING { least_area_faces(&at, &taken) } else { None };
        match least {
            Some(spanned) => faces.extend(spanned.into_iter().map(|face| face.map(|k| ring[k]))),
            None => {
                let center = VertexId::from_index(points.len());
                points.push(ring_center(&at));
                faces.extend((0..ring.len()).map(|k| [ring[(k + 1) % ring.len()], ring[k], center]));
            }
        }
    }
    // All points are finite and all indices in range, so this is the filled mesh.
    let mesh = TriMesh::try_new(points, faces).unwrap_or_else(|_| open.clone());
    ClosedPart { mesh, garment_vertex, rings }
}
