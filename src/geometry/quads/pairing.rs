//! Joins triangles of the lattice in pairs to quads, across their diagonals.

use super::quality::quad_quality_deg;
use crate::geometry::{Point, Vec3};
use std::collections::HashMap;

/// Quads with a smaller angle than this (or a greater one than 180° minus this) are not made, in degrees: two triangles are
/// better, which become six good quads.
const LEAST_DEG: f64 = 38.0;

/// The quads, and the triangles without a partner.
pub(super) fn paired(points: &[Point], normals: &[Vec3], triangles: &[[u32; 3]]) -> (Vec<[u32; 4]>, Vec<[u32; 3]>) {
    let mut face_of_side: HashMap<[u32; 2], u32> = HashMap::with_capacity(triangles.len() * 3);
    for (f, &[a, b, c]) in (0u32..).zip(triangles) {
        face_of_side.extend([[a, b], [b, c], [c, a]].map(|side| (side, f)));
    }
    let mut candidates: Vec<(f64, u32, u32, [u32; 4])> = Vec::new();
    for (f, &[a, b, c]) in (0u32..).zip(triangles) {
        for [a, b, c] in [[a, b, c], [b, c, a], [c, a, b]] {
            let Some(&g) = face_of_side.get(&[b, a]).filter(|&&g| g > f) else { continue };
            let Some(d) = triangles[g as usize].into_iter().find(|&v| v != a && v != b) else { continue };
            let quad = [a, d, b, c];
            let normal: Vec3 = quad.iter().map(|&v| normals[v as usize]).sum();
            let quality = if c == d { 0.0 } else { quad_quality_deg(&quad.map(|v| points[v as usize]), &normal) };
            if quality > LEAST_DEG {
                candidates.push((quality, f, g, quad));
            }
        }
    }
    candidates.sort_unstable_by(|x, y| y.0.total_cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    let mut is_free = vec![true; triangles.len()];
    let mut quads = Vec::new();
    for (_, f, g, quad) in candidates {
        if is_free[f as usize] && is_free[g as usize] {
            is_free[f as usize] = false;
            is_free[g as usize] = false;
            quads.push(quad);
        }
    }
    let alone = triangles.iter().zip(is_free).filter(|(_, free)| *free).map(|(t, _)| *t).collect();
    (quads, alone)
}
