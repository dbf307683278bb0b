//! Marching tetrahedra: the zero surface of a field, manifold wherever the field is known.

use crate::geometry::{Point, TriMesh};
use crate::studio::level_set::LevelSet;
use std::collections::HashMap;

/// Six tetrahedra around a cube's diagonal, each with positive field; corner k is at (k & 1, k >> 1 & 1, k >> 2).
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];

/// The zero surface, oriented toward positive distances. Tetrahedra with an unknown corner become holes.
///
/// **Guarantees** no edge has more than two faces; the order of vertices and faces depends on the field alone.
///
/// **Source** Doi & Koide 1991; unlike marching cubes there is no ambiguous case.
pub(super) fn zero_surface(field: &LevelSet) -> TriMesh {
    let [nx, ny, nz] = field.size;
    let offsets: [usize; 8] = std::array::from_fn(|k| (k & 1) + nx * ((k >> 1 & 1) + ny * (k >> 2)));
    let mut surface = IsosurfaceBuilder { field, points: Vec::new(), faces: Vec::new(), on_edge: HashMap::new() };
    for z in 0..nz - 1 {
        for y in 0..ny - 1 {
            for x in 0..nx - 1 {
                let nodes = offsets.map(|o| o + x + nx * (y + ny * z));
                let values = nodes.map(|n| field.distance[n]);
                if values.iter().any(|v| *v < 0.0) && values.iter().any(|v| *v >= 0.0) {
                    for corners in TETRAHEDRA {
                        surface.add(corners.map(|c| nodes[c]));
                    }
                }
            }
        }
    }
    TriMesh::try_from_indices(surface.points, &surface.faces).expect("interpolated between finite nodes")
}

struct IsosurfaceBuilder<'a> {
    field: &'a LevelSet,
    points: Vec<Point>,
    faces: Vec<[u32; 3]>,
    on_edge: HashMap<(usize, usize), u32>,
}

impl IsosurfaceBuilder<'_> {
    fn add(&mut self, nodes: [usize; 4]) {
        let values = nodes.map(|n| self.field.distance[n]);
        if values.iter().any(|v| v.is_nan()) {
            return;
        }
        let (order, inside) = inside_first(values.map(|v| v < 0.0));
        let [a, b, c, d] = order.map(|k| nodes[k]);
        match inside {
            1 => self.triangle([(a, b), (a, c), (a, d)]),
            2 => {
                self.triangle([(a, c), (a, d), (b, d)]);
                self.triangle([(a, c), (b, d), (b, c)]);
            }
            3 => self.triangle([(d, a), (d, b), (d, c)]),
            _ => {}
        }
    }

    fn triangle(&mut self, edges: [(usize, usize); 3]) {
        let corners = edges.map(|(p, q)| self.vertex(p.min(q), p.max(q)));
        self.faces.push(corners);
    }

    fn vertex(&mut self, p: usize, q: usize) -> u32 {
        /// Least distance of a vertex from the ends of its edge, as a share of the edge: avoids slivers without area.
        const AWAY: f64 = 0.05;
        if let Some(&id) = self.on_edge.get(&(p, q)) {
            return id;
        }
        let (dp, dq) = (f64::from(self.field.distance[p]), f64::from(self.field.distance[q]));
        let t = (dp / (dp - dq)).clamp(AWAY, 1.0 - AWAY);
        let [nx, ny, _] = self.field.size;
        let at = |n: usize| self.field.node(n % nx, n / nx % ny, n / (nx * ny));
        let id = self.points.len() as u32;
        self.points.push(at(p) + (at(q) - at(p)) * t);
        self.on_edge.insert((p, q), id);
        id
    }
}

/// An even permutation that puts the corners inside first, and their number.
fn inside_first(inside: [bool; 4]) -> ([usize; 4], usize) {
    let count = inside.iter().filter(|&&i| i).count();
    let mut order: Vec<usize> = (0..4).filter(|&k| inside[k]).chain((0..4).filter(|&k| !inside[k])).collect();
    let swaps = (0..4).flat_map(|i| (0..i).map(move |j| (i, j))).filter(|&(i, j)| order[j] > order[i]).count();
    if swaps % 2 == 1 {
        // Swap two corners of one side: the last two, or the first two where only one is outside.
        if count <= 2 { order.swap(2, 3) } else { order.swap(0, 1) }
    }
    ([order[0], order[1], order[2], order[3]], count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Aabb, Adjacency};

    #[test]
    fn a_ball_is_closed_outward_and_manifold_and_an_unknown_cap_is_one_hole() {
        let bounds = Aabb { min: Point::new(-1.0, -1.0, -1.0), max: Point::new(1.0, 1.0, 1.0) };
        let mut field = LevelSet::covering(&bounds, 0.3, 0.1);
        field.fill(|p| (p.coords.norm() - 1.0) as f32);
        let ball = zero_surface(&field);
        assert!((ball.signed_volume() - 4.19).abs() < 0.1, "{}", ball.signed_volume());
        let adjacency = Adjacency::prepare(&ball);
        assert!(adjacency.boundary_edges().is_empty());
        assert_eq!(ball.vertex_count() + ball.face_count(), adjacency.edges().len() + 2, "Euler's formula");
        field.fill(|p| if p.y > 0.6 { f32::NAN } else { (p.coords.norm() - 1.0) as f32 });
        assert_eq!(Adjacency::prepare(&zero_surface(&field)).boundary_loops().len(), 1);
    }

    #[test]
    fn two_balls_that_nearly_touch_stay_manifold() {
        let bounds = Aabb { min: Point::new(-1.0, -0.5, -0.5), max: Point::new(1.0, 0.5, 0.5) };
        let mut field = LevelSet::covering(&bounds, 0.1, 0.07);
        field.fill(|p| {
            let to = |x: f64| (p - Point::new(x, 0.0, 0.0)).norm() - 0.5;
            to(-0.49).min(to(0.49)) as f32
        });
        let mesh = zero_surface(&field);
        let adjacency = Adjacency::prepare(&mesh);
        assert!(adjacency.boundary_edges().is_empty());
        assert_eq!(2 * adjacency.edges().len(), 3 * mesh.face_count(), "every edge has two faces");
    }
}
