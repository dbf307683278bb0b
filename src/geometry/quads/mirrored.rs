//! Surfaces whose halves correspond to each other: one is re-meshed, the other gets the same quads.

use super::error::QuadError;
use super::subdivision::Quads;
use super::{QuadMesh, check_size, quads_of_surface};
use crate::geometry::{PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId};
use std::cmp::Ordering;

/// Re-meshes a surface as [`quad_mesh`](super::quad_mesh) does, with quads that are as symmetric as its faces: each half has
/// those of the other, and edges run along the middle. `mirror` is the vertex opposite to each, itself in the middle; the halves
/// need not have the same shape.
///
/// **Shapes** `mirror`: one entry per vertex.
///
/// `None` if the faces are not symmetric: some have vertices of both halves, or no opposite face.
pub fn mirrored_quad_mesh(
    mesh: &TriMesh,
    mirror: &PerVertex<VertexId>,
    edge_length: f64,
) -> Result<Option<QuadMesh>, QuadError> {
    check_size(mesh, edge_length)?;
    let Some((half, whole_from_half)) = half_of(mesh, mirror) else { return Ok(None) };
    let quads = quads_of_surface(&half, edge_length, true)?;
    let index = SurfaceIndex::prepare(&half);
    let opposite = |p: &Point| -> Point {
        let place = index.closest(p);
        let corners = half.faces()[place.face].map(|v| mesh.points()[mirror[whole_from_half[v]]]);
        Point::from(corners.iter().zip(place.barycentric).map(|(p, share)| p.coords * share).sum::<Vec3>())
    };
    let mut points = quads.points.clone();
    // In the middle each vertex is its own opposite.
    let opposites: Vec<u32> = (0u32..)
        .zip(quads.points.iter().zip(&quads.on_border))
        .map(|(v, (p, on_border))| {
            if on_border.is_some() {
                return v;
            }
            points.push(opposite(p));
            points.len() as u32 - 1
        })
        .collect();
    let turned = |quad: &[u32; 4]| {
        let [a, b, c, d] = quad.map(|v| opposites[v as usize]);
        [a, d, c, b]
    };
    let both = quads.quads.iter().copied().chain(quads.quads.iter().map(turned)).collect();
    let on_border = vec![None; points.len()];
    let on_face = vec![0; points.len()];
    Ok(Some(QuadMesh::of(Quads { points, quads: both, on_border, on_face }, edge_length)))
}

/// The faces with a vertex at greater x than its opposite, and which vertex of the whole each of theirs is.
fn half_of(mesh: &TriMesh, mirror: &PerVertex<VertexId>) -> Option<(TriMesh, PerVertex<VertexId>)> {
    let is_mirror = |(v, opposite): (VertexId, &VertexId)| opposite.index() < mirror.len() && mirror[*opposite] == v;
    if mirror.len() != mesh.vertex_count() || !mirror.enumerate().all(is_mirror) {
        return None;
    }
    let side = |v: VertexId| match mirror[v] == v {
        true => Ordering::Equal,
        false => mesh.points()[v].x.total_cmp(&mesh.points()[mirror[v]].x),
    };
    let is_of = |face: &[VertexId; 3], wanted: Ordering| {
        face.iter().any(|v| side(*v) == wanted) && face.iter().all(|v| side(*v) != wanted.reverse())
    };
    let sorted = |mut face: [VertexId; 3]| {
        face.sort_unstable();
        face
    };
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    for face in mesh.faces().iter() {
        match (is_of(face, Ordering::Greater), is_of(face, Ordering::Less)) {
            (true, false) => ours.push(sorted(face.map(|v| mirror[v]))),
            (false, true) => theirs.push(sorted(*face)),
            _ => return None,
        }
    }
    ours.sort_unstable();
    theirs.sort_unstable();
    (ours == theirs).then(|| mesh.part(&mesh.faces().iter().map(|face| is_of(face, Ordering::Greater)).collect()))
}
