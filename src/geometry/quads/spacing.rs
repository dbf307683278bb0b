//! How far apart the lattice's points are: closer on fingers, which would not survive quads as wide as they are.

use super::surface::Surface;
use crate::geometry::{SurfaceIndex, TriMesh};
use rayon::prelude::*;

/// The spacing as a share of the thickness of the solid below: four lattice points around a finger.
const PER_THICKNESS: f64 = 0.78;

/// The least spacing, as a share of that elsewhere.
const LEAST: f64 = 0.35;

/// How much the spacing may change per metre along the surface, in metres: rows of quads end where it changes.
const GROWTH: f64 = 0.3;

/// Sweeps that spread small spacings to their surroundings; each goes far in the order of the vertices.
const SWEEPS: usize = 20;

/// The spacing at each vertex: `usual` on cloth, which has borders, and less on thin parts of solids.
pub(super) fn spacings(surface: &Surface, usual: f64) -> Vec<f64> {
    let mut all = vec![usual; surface.points.len()];
    let Some(mesh) =
        TriMesh::try_from_indices(surface.points.clone(), &surface.faces).ok().filter(|_| surface.is_solid)
    else {
        return all;
    };
    let index = SurfaceIndex::prepare(&mesh);
    let farthest = usual / PER_THICKNESS;
    all.par_iter_mut().enumerate().for_each(|(v, spacing)| {
        let inwards = -surface.normals[v];
        let start = surface.points[v] + inwards * (1e-3 * usual);
        let hit =
            index.cast_ray(&start, &inwards, farthest).filter(|hit| mesh.face_normal(hit.face).dot(&inwards) > 0.3);
        if let Some(hit) = hit {
            *spacing = (PER_THICKNESS * hit.distance).clamp(LEAST * usual, usual);
        }
    });
    let edges = surface.edges();
    for sweep in 0..SWEEPS {
        let mut spread = |&(v, w): &(u32, u32)| {
            let way = (surface.points[v as usize] - surface.points[w as usize]).norm();
            all[w as usize] = all[w as usize].min(all[v as usize] + GROWTH * way);
        };
        if sweep % 2 == 0 { edges.iter().for_each(&mut spread) } else { edges.iter().rev().for_each(&mut spread) }
    }
    all
}
