//! Drops fins and islands, and separates fans of faces that touch in one vertex.

use super::holes::fill_holes::FilledScan;
use super::slice::Slice;
use crate::geometry::{Adjacency, FaceId, MeshError, PerFace, TriMesh, VertexId, manifold_part};

/// Drops the faces by which an edge has more than two, as fused scans have them where sheets touch.
pub(super) fn without_fins(slice: Slice) -> Slice {
    let keep = manifold_part(&slice.mesh);
    if keep.iter().all(|&kept| kept) { slice } else { slice.part(&keep) }
}

/// Drops the components with less than `least_share` of the area that the user did not paint.
pub(super) fn without_islands(slice: Slice, whole: &FilledScan, least_share: f64, findings: &mut Vec<String>) -> Slice {
    let (component, count) = slice.adjacency().face_components();
    if count <= 1 {
        return slice;
    }
    let mut areas = vec![0.0; count];
    for f in slice.mesh.face_ids() {
        areas[component[f] as usize] += slice.mesh.face_area(f);
    }
    let total: f64 = areas.iter().sum();
    let mut stays: Vec<bool> = areas.iter().map(|&a| a >= least_share * total).collect();
    for f in slice.mesh.face_ids() {
        let origins = slice.mesh.faces()[f].iter().flat_map(|v| slice.origins[v.index()]);
        stays[component[f] as usize] |=
            origins.into_iter().any(|(v, factor)| factor > 0.0 && whole.by_hand[v] && whole.labels.0[v]);
    }
    let keep: PerFace<bool> = component.iter().map(|&c| stays[c as usize]).collect();
    let dropped: Vec<f64> = (0..count).filter(|&c| !stays[c]).map(|c| areas[c]).collect();
    if dropped.is_empty() {
        return slice;
    }
    findings.push(format!(
        "removed {} island{} with {:.1} cm² in total",
        dropped.len(),
        if dropped.len() == 1 { "" } else { "s" },
        dropped.iter().sum::<f64>() * 1e4
    ));
    slice.part(&keep)
}

/// Gives each fan of faces around a vertex its own vertex, so that every boundary is a simple curve.
pub(super) fn with_bow_ties_split(slice: Slice) -> Result<Slice, MeshError> {
    let (mesh, adjacency) = (&slice.mesh, slice.adjacency());
    let torn: Vec<(VertexId, Vec<FaceId>)> =
        mesh.vertex_ids().flat_map(|v| fans(mesh, adjacency, v).into_iter().skip(1).map(move |fan| (v, fan))).collect();
    if torn.is_empty() {
        return Ok(slice);
    }
    let Slice { mesh, mut origins, mut on_cut, mut is_seen, .. } = slice;
    let mut points = mesh.points().0.clone();
    let mut faces = mesh.faces().0.clone();
    for (v, fan) in torn {
        let twin = VertexId::from_index(points.len());
        points.push(mesh.points()[v]);
        origins.push(origins[v.index()]);
        on_cut.push(on_cut[v.index()]);
        is_seen.push(is_seen[v.index()]);
        for f in fan {
            for corner in &mut faces[f.index()] {
                if *corner == v {
                    *corner = twin;
                }
            }
        }
    }
    Ok(Slice::new(TriMesh::try_new(points, faces)?, origins, on_cut, is_seen))
}

/// The faces at `v`, grouped by shared edges at `v`.
fn fans(mesh: &TriMesh, adjacency: &Adjacency, v: VertexId) -> Vec<Vec<FaceId>> {
    let faces = adjacency.faces_of(v);
    let mut left: Vec<FaceId> = faces.to_vec();
    let mut fans = Vec::new();
    while let Some(seed) = (!left.is_empty()).then(|| left.remove(0)) {
        let mut fan = vec![seed];
        let mut at = 0;
        while at < fan.len() {
            let corners = mesh.faces()[fan[at]];
            let across = adjacency.face_neighbours(fan[at]);
            for k in 0..3 {
                let touches_v = corners[k] == v || corners[(k + 1) % 3] == v;
                if let (true, Some(next)) = (touches_v, across[k])
                    && let Some(i) = left.iter().position(|&f| f == next)
                {
                    fan.push(left.remove(i));
                }
            }
            at += 1;
        }
        fans.push(fan);
    }
    fans
}
