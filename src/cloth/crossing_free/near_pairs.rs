//! The pairs of a vertex and a face, or of two edges, that may touch within a step.

use super::surfaces::Surfaces;
use super::swept_tree::{Swept, SweptTree};
use crate::geometry::{Point, Vec3, closest_on_segments, closest_on_triangle};
use rayon::prelude::*;

/// Two primitives that may touch within a step: a vertex and a face, or two edges.
#[derive(Clone, Copy, Debug)]
pub(in crate::cloth) struct NearPair {
    /// Their vertices: the first `split` are those of the first primitive.
    pub vertices: [u32; 4],
    pub split: u8,
    /// Weights of the vertices in the closest points, negative on the first primitive: the sum of weight and position is
    /// `normal · distance`.
    pub weights: [f32; 4],
    /// From the first primitive to the second, at the start of the step.
    pub normal: Vec3,
    /// At the start of the step, metres.
    pub distance: f64,
    /// Distance in metres that contact keeps: no more than in the bind pose, where nothing pushes.
    pub gap: f32,
}

/// A search for near pairs.
///
/// **Shapes** `at`, `by`, `slack`: one entry per vertex.
pub(in crate::cloth) struct Search<'a> {
    pub surfaces: &'a Surfaces,
    pub tree: &'a SweptTree,
    /// Positions at the start of the step.
    pub at: &'a [Point],
    /// Expected displacements within the step.
    pub by: &'a [Vec3],
    /// How far each displacement may differ from the expected one, metres.
    pub slack: &'a [f64],
    /// Distance from which contact acts, metres.
    pub reach: f64,
    /// The gap that contact keeps, metres.
    pub gap: f64,
}

/// The boxes of all primitives.
struct Boxes {
    vertices: Vec<Swept>,
    edges: Vec<Swept>,
    faces: Vec<Swept>,
}

impl Search<'_> {
    /// All pairs that may come within `reach` of each other if every displacement is within its slack.
    ///
    /// **Guarantees** all of them, in an order that does not depend on the number of threads.
    pub fn all(&self) -> Vec<NearPair> {
        let (boxes, reach) = (self.boxes(), self.reach as f32);
        let nodes = self.tree.boxes(&boxes.faces);
        let found: Vec<Vec<NearPair>> = self
            .tree
            .tasks(&nodes, reach)
            .into_par_iter()
            .map(|task| {
                let mut pairs = Vec::new();
                self.tree.visit(task, &nodes, &boxes.faces, reach, |f, g| self.between(f, g, &boxes, &mut pairs));
                pairs
            })
            .collect();
        found.concat()
    }

    /// The pairs of which at least one primitive lies in one of the faces, which are in ascending order.
    pub fn of_faces(&self, faces: &[u32]) -> Vec<NearPair> {
        let (boxes, reach) = (self.boxes(), self.reach as f32);
        let nodes = self.tree.boxes(&boxes.faces);
        let found: Vec<Vec<NearPair>> = faces
            .par_iter()
            .map(|&f| {
                let mut pairs = Vec::new();
                self.tree.visit_near(f, &nodes, &boxes.faces, reach, |g| {
                    // Of two of the faces, the first searches.
                    if g > f || faces.binary_search(&g).is_err() {
                        self.between(f, g, &boxes, &mut pairs);
                    }
                });
                pairs
            })
            .collect();
        found.concat()
    }

    fn boxes(&self) -> Boxes {
        let vertices: Vec<Swept> =
            (0..self.at.len()).into_par_iter().map(|v| Swept::point(&self.at[v], &self.by[v], self.slack[v])).collect();
        let of = |v: u32| &vertices[v as usize];
        let edges = self.surfaces.edges.par_iter().map(|&[a, b]| of(a).join(of(b))).collect();
        let faces = of_faces(self.surfaces, &vertices);
        Boxes { edges, faces, vertices }
    }

    /// The pairs of two faces: each vertex and each edge by the one face that stands for it.
    fn between(&self, f: u32, g: u32, boxes: &Boxes, pairs: &mut Vec<NearPair>) {
        let (s, reach) = (self.surfaces, self.reach as f32);
        if f.max(g) < s.unpaired_faces {
            return;
        }
        let [of_f, of_g] = [f, g].map(|k| s.faces[k as usize]);
        let [own_f, own_g] = [f, g].map(|k| s.owned[k as usize]);
        for k in 0..3 {
            for (own, v, other, face) in [(own_f, of_f[k], of_g, g), (own_g, of_g[k], of_f, f)] {
                let stands = own >> k & 1 == 1 && !other.contains(&v);
                if stands && boxes.vertices[v as usize].meets(&boxes.faces[face as usize], reach) {
                    self.add([v, other[0], other[1], other[2]], 1, pairs);
                }
            }
        }
        for k in (0..3).filter(|k| own_f >> (3 + k) & 1 == 1) {
            let d = s.sides[f as usize][k] as usize;
            for l in (0..3).filter(|l| own_g >> (3 + l) & 1 == 1) {
                let e = s.sides[g as usize][l] as usize;
                let ([a, b], [p, q]) = (s.edges[d], s.edges[e]);
                if a != p && a != q && b != p && b != q && boxes.edges[d].meets(&boxes.edges[e], reach) {
                    self.add([a, b, p, q], 2, pairs);
                }
            }
        }
    }

    fn add(&self, vertices: [u32; 4], split: u8, pairs: &mut Vec<NearPair>) {
        let (way, weights) = way_between(&vertices.map(|v| self.at[v as usize]), split);
        let distance = way.norm();
        if distance <= 0.0 {
            return;
        }
        let normal = way / distance;
        let (mut nearest, mut farthest) = (f64::MIN, f64::MAX);
        for (k, v) in vertices.into_iter().enumerate() {
            let (along, slack) = (normal.dot(&self.by[v as usize]), self.slack[v as usize]);
            if k < usize::from(split) {
                nearest = nearest.max(along + slack);
            } else {
                farthest = farthest.min(along - slack);
            }
        }
        // The plane between the two, moved along, keeps them farther apart.
        if distance - (nearest - farthest).max(0.0) > self.reach {
            return;
        }
        let (at_rest, _) = way_between(&vertices.map(|v| self.surfaces.rest[v as usize]), split);
        let gap = at_rest.norm().min(self.gap).min(distance + FASTEST_PUSH) as f32;
        pairs.push(NearPair { vertices, split, weights: weights.map(|w| w as f32), normal, distance, gap });
    }
}

fn of_faces(surfaces: &Surfaces, vertices: &[Swept]) -> Vec<Swept> {
    let of = |v: u32| &vertices[v as usize];
    surfaces.faces.par_iter().map(|&[a, b, c]| of(a).join(of(b)).join(of(c))).collect()
}

/// The boxes of all faces while nothing moves.
///
/// **Shapes** `at`: one entry per vertex; the result: one entry per face.
pub(in crate::cloth) fn still_faces(surfaces: &Surfaces, at: &[Point]) -> Vec<Swept> {
    let vertices: Vec<Swept> = at.par_iter().map(|p| Swept::point(p, &Vec3::zeros(), 0.0)).collect();
    of_faces(surfaces, &vertices)
}

/// A gap that became too narrow is widened by this much per step, metres: contact must not throw cloth off.
const FASTEST_PUSH: f64 = 1e-4;

/// The shortest way from the first primitive to the second, and the weight of each vertex in it.
pub(in crate::cloth) fn way_between(at: &[Point; 4], split: u8) -> (Vec3, [f64; 4]) {
    let [a, b, c, d] = at;
    if split == 1 {
        let ([u, v, w], on_face) = closest_on_triangle(a, &[*b, *c, *d]);
        (on_face - a, [-1.0, u, v, w])
    } else {
        let [s, t] = closest_on_segments([a, b], [c, d]);
        ((c + (d - c) * t) - (a + (b - a) * s), [s - 1.0, -s, 1.0 - t, t])
    }
}
