//! The scan's colours on the registered surface.

use crate::fit::correspondence::ScanSurface;
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, Vec3};
use rayon::prelude::*;

/// The scan's colours at the closest points. **Shapes** one entry per vertex of `mesh`.
pub(crate) fn colors_of(surface: &ScanSurface, colors: &PerVertex<[u8; 3]>, mesh: &TriMesh) -> Vec<Option<Vec3>> {
    let normals = mesh.vertex_normals();
    let at = |i: usize| color_at(surface, colors, &mesh.points().0[i], &normals.0[i]);
    (0..mesh.vertex_count()).into_par_iter().map(at).collect()
}

/// The scan's colour at the closest point, if that faces nearly the same way.
pub(crate) fn color_at(surface: &ScanSurface, colors: &PerVertex<[u8; 3]>, p: &Point, n: &Vec3) -> Option<Vec3> {
    /// Beyond this distance a colour belongs to something else. Metres.
    const REACH: f64 = 0.02;
    let s = surface.index.closest_within(p, REACH)?;
    let corners = surface.mesh().faces()[s.face];
    let normal: Vec3 = (0..3).map(|k| surface.normals[corners[k]] * s.barycentric[k]).sum();
    (normal.dot(n) > 0.3)
        .then(|| (0..3).map(|k| Vec3::from(colors[corners[k]].map(f64::from)) * s.barycentric[k]).sum())
}

/// Fills vertices without a colour from their neighbours. **Shapes** one colour per vertex.
pub(crate) fn flowed_in(mut baked: Vec<Option<Vec3>>, mesh: &TriMesh) -> PerVertex<[u8; 3]> {
    let adjacency = Adjacency::prepare(mesh);
    // Each pass fills one more ring.
    while baked.iter().any(Option::is_none) {
        let before = baked.clone();
        for v in mesh.vertex_ids().filter(|v| before[v.index()].is_none()) {
            let known: Vec<Vec3> = adjacency.neighbours_of(v).iter().filter_map(|n| before[n.index()]).collect();
            if !known.is_empty() {
                baked[v.index()] = Some(known.iter().sum::<Vec3>() / known.len() as f64);
            }
        }
        if baked.iter().filter(|c| c.is_none()).count() == before.iter().filter(|c| c.is_none()).count() {
            break;
        }
    }
    /// Colour of vertices that no coloured vertex is connected to.
    const PLAIN: Vec3 = Vec3::new(200.0, 170.0, 150.0);
    baked.into_iter().map(|c| c.unwrap_or(PLAIN).map(|x| x.round().clamp(0.0, 255.0) as u8).into()).collect()
}
