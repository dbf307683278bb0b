//! A first triangle mesh of the left half by marching tetrahedra (Doi 1991; Kuhn's six tetrahedra per cell, so that
//! neighbours agree and the mesh is a manifold whose boundary lies exactly on x = 0).

use super::field::Field;
use crate::geometry::Vec3;
use std::collections::HashMap;

/// Cells along a block's side: blocks far from the surface are skipped whole.
const BLOCK: usize = 8;
/// Field values may exceed the distance by this factor where a section slopes (shoulder tops).
const STEEPEST: f64 = 2.6;

/// Vertices and triangles of the surface within x ≥ 0, outward counter-clockwise.
pub(super) fn extract_half(field: &Field, low: Vec3, high: Vec3, cell: f64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let count = ((high - low) / cell).map(|x| (x / BLOCK as f64).ceil() as usize * BLOCK);
    let (nx, ny) = (count.x + 1, count.y + 1);
    let place = |i: usize, j: usize, k: usize| low + Vec3::new(i as f64, j as f64, k as f64) * cell;
    let id = |i: usize, j: usize, k: usize| ((k * ny + j) * nx + i) as u64;
    let mut mesh = Marching { vertices: Vec::new(), faces: Vec::new(), on_edge: HashMap::new() };
    let mut values: HashMap<u64, f64> = HashMap::new();
    let reach = 0.5 * BLOCK as f64 * cell * 3f64.sqrt() * STEEPEST;
    for bk in (0..count.z).step_by(BLOCK) {
        for bj in (0..count.y).step_by(BLOCK) {
            for bi in (0..count.x).step_by(BLOCK) {
                let center = place(bi, bj, bk) + Vec3::repeat(0.5 * BLOCK as f64 * cell);
                if field.value(&center).abs() > reach {
                    continue;
                }
                for k in bk..bk + BLOCK {
                    for j in bj..bj + BLOCK {
                        for i in bi..bi + BLOCK {
                            let corners: [(u64, Vec3, f64); 8] = std::array::from_fn(|c| {
                                let (a, b, d) = (i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1));
                                let (key, p) = (id(a, b, d), place(a, b, d));
                                let value = *values.entry(key).or_insert_with(|| {
                                    let f = field.value(&p);
                                    // A zero at a grid point would collapse triangles to a point.
                                    if f.abs() < 1e-7 { 1e-7 } else { f }
                                });
                                (key, p, value)
                            });
                            mesh.cell(&corners);
                        }
                    }
                }
            }
        }
    }
    (mesh.vertices, mesh.faces)
}

struct Marching {
    vertices: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
    on_edge: HashMap<(u64, u64), u32>,
}

/// Kuhn's tetrahedra: paths from corner 0 to corner 7, one axis after another.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];

impl Marching {
    fn cell(&mut self, corners: &[(u64, Vec3, f64); 8]) {
        let inside = corners.iter().filter(|c| c.2 < 0.0).count();
        if inside == 0 || inside == 8 {
            return;
        }
        for tet in TETRAHEDRA {
            let (inner, outer): (Vec<usize>, Vec<usize>) = tet.iter().partition(|&&c| corners[c].2 < 0.0);
            let mut cut = |a: usize, b: usize| self.cut(&corners[a], &corners[b]);
            let loop_of: Vec<u32> = match (inner.as_slice(), outer.as_slice()) {
                ([a], [b, c, d]) | ([b, c, d], [a]) => vec![cut(*a, *b), cut(*a, *c), cut(*a, *d)],
                ([a, b], [c, d]) => vec![cut(*a, *c), cut(*a, *d), cut(*b, *d), cut(*b, *c)],
                _ => continue,
            };
            let middle = |set: &[usize]| set.iter().map(|&c| corners[c].1).sum::<Vec3>() / set.len() as f64;
            let outward = middle(&outer) - middle(&inner);
            let p = |k: usize| self.vertices[loop_of[k] as usize];
            let normal = if loop_of.len() == 4 {
                (p(2) - p(0)).cross(&(p(3) - p(1)))
            } else {
                (p(1) - p(0)).cross(&(p(2) - p(0)))
            };
            let flip = normal.dot(&outward) < 0.0;
            for k in 2..loop_of.len() {
                let (a, b, c) = (loop_of[0], loop_of[k - 1], loop_of[k]);
                self.faces.push(if flip { [a, c, b] } else { [a, b, c] });
            }
        }
    }

    fn cut(&mut self, a: &(u64, Vec3, f64), b: &(u64, Vec3, f64)) -> u32 {
        let vertices = &mut self.vertices;
        *self.on_edge.entry((a.0.min(b.0), a.0.max(b.0))).or_insert_with(|| {
            // Away from the ends, so that no triangle has no area; the surface is found again by projection.
            let s = (a.2 / (a.2 - b.2)).clamp(0.02, 0.98);
            vertices.push(a.1 + (b.1 - a.1) * s);
            (vertices.len() - 1) as u32
        })
    }
}
