//! Isotropic remeshing of the half body to a sizing field (Botsch and Kobbelt 2004: split, collapse, flip, relax),
//! with the boundary kept on x = 0.

use super::field::Field;
use crate::geometry::Vec3;

/// Rounds of split, collapse, flip and relax: the edge-length histogram no longer changes after about ten.
const ROUNDS: usize = 14;

/// The half mesh during remeshing; removed faces remain as holes in the array.
pub(super) struct Remesher<'a> {
    field: &'a Field,
    points: Vec<Vec3>,
    size: Vec<f64>,
    faces: Vec<Option<[u32; 3]>>,
    around: Vec<Vec<u32>>,
}

impl<'a> Remesher<'a> {
    pub fn new(field: &'a Field, points: Vec<Vec3>, faces: &[[u32; 3]]) -> Self {
        let mut around = vec![Vec::new(); points.len()];
        for (f, face) in faces.iter().enumerate() {
            for v in face {
                around[*v as usize].push(f as u32);
            }
        }
        let size = points.iter().map(|p| field.wanted_edge(p)).collect();
        Self { field, points, size, faces: faces.iter().map(|f| Some(*f)).collect(), around }
    }

    /// Vertices and faces after all rounds.
    pub fn run(mut self, mut on_round: impl FnMut(usize, usize)) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        // The first mesh is far too fine: collapse alone, lengths growing, before anything else.
        for part in [0.3, 0.45, 0.6, 0.8] {
            while self.collapse(part) > self.points.len() / 500 {}
            self.flip();
            self.relax(2);
        }
        for round in 0..ROUNDS {
            self.split();
            self.collapse(0.75);
            self.flip();
            for v in 0..self.points.len() {
                if !self.around[v].is_empty() {
                    self.size[v] = self.field.wanted_edge(&self.points[v]);
                }
            }
            self.smooth_sizes();
            self.relax(4);
            self.flip();
            on_round(round + 1, ROUNDS);
        }
        self.relax(10);
        self.compact()
    }

    fn on_plane(&self, v: u32) -> bool {
        self.points[v as usize].x == 0.0
    }

    fn edge(&self, a: u32, b: u32) -> f64 {
        (self.points[a as usize] - self.points[b as usize]).norm()
    }

    fn wanted(&self, a: u32, b: u32) -> f64 {
        self.size[a as usize].min(self.size[b as usize])
    }

    fn normal(&self, [a, b, c]: [u32; 3]) -> Vec3 {
        let p = |v: u32| self.points[v as usize];
        (p(b) - p(a)).cross(&(p(c) - p(a)))
    }

    fn faces_with(&self, a: u32, b: u32) -> Vec<u32> {
        let holds = |f: &u32| self.faces[*f as usize].is_some_and(|face| face.contains(&b));
        self.around[a as usize].iter().copied().filter(holds).collect()
    }

    fn neighbours(&self, v: u32) -> Vec<u32> {
        let mut all: Vec<u32> = self.around[v as usize]
            .iter()
            .filter_map(|f| self.faces[*f as usize])
            .flatten()
            .filter(|w| *w != v)
            .collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    fn live_faces(&self) -> Vec<(u32, [u32; 3])> {
        self.faces.iter().enumerate().filter_map(|(f, face)| face.map(|face| (f as u32, face))).collect()
    }

    fn split(&mut self) {
        let mut edges: Vec<(u32, u32)> = Vec::new();
        for (_, [a, b, c]) in self.live_faces() {
            for (x, y) in [(a, b), (b, c), (c, a)] {
                if self.edge(x, y) > 1.38 * self.wanted(x, y) {
                    edges.push((x.min(y), x.max(y)));
                }
            }
        }
        edges.sort_unstable();
        edges.dedup();
        for (a, b) in edges {
            let shared = self.faces_with(a, b);
            let new = self.points.len() as u32;
            let border = shared.len() == 1;
            let mut p = 0.5 * (self.points[a as usize] + self.points[b as usize]);
            if border {
                p.x = 0.0;
            } else if p.x == 0.0 {
                // An inner edge between two border vertices: its middle must leave the plane.
                p.x = 1e-4;
            }
            let p = self.field.project(&p, 4);
            self.points.push(p);
            self.size.push(self.field.wanted_edge(&p));
            self.around.push(Vec::new());
            for f in shared {
                let Some(face) = self.faces[f as usize] else { continue };
                let first = face.map(|v| if v == b { new } else { v });
                let second = face.map(|v| if v == a { new } else { v });
                self.faces[f as usize] = Some(first);
                self.around[b as usize].retain(|x| *x != f);
                let g = self.faces.len() as u32;
                self.faces.push(Some(second));
                for v in second {
                    self.around[v as usize].push(g);
                }
                self.around[new as usize].push(f);
            }
        }
    }

    /// Collapses edges shorter than `part` of the target length; returns their number.
    fn collapse(&mut self, part: f64) -> usize {
        let mut done = 0;
        for f in 0..self.faces.len() {
            let Some([a, b, c]) = self.faces[f] else { continue };
            for (x, y) in [(a, b), (b, c), (c, a)] {
                if self.edge(x, y) < part * self.wanted(x, y) && self.try_collapse(x, y) {
                    done += 1;
                    break;
                }
            }
        }
        done
    }

    fn try_collapse(&mut self, a: u32, b: u32) -> bool {
        let shared = self.faces_with(a, b);
        // `keep` stays, `gone` goes; a border vertex stays on the border.
        let (keep, gone) = match (self.on_plane(a), self.on_plane(b)) {
            (true, true) if shared.len() != 1 => return false,
            (false, true) => (b, a),
            _ => (a, b),
        };
        let (near_keep, near_gone) = (self.neighbours(keep), self.neighbours(gone));
        let common = near_keep.iter().filter(|v| near_gone.contains(v)).count();
        if common != shared.len() {
            return false;
        }
        let both = self.on_plane(keep) == self.on_plane(gone);
        let target = if both {
            0.5 * (self.points[keep as usize] + self.points[gone as usize])
        } else {
            self.points[keep as usize]
        };
        let longest = 1.35;
        for v in near_keep.iter().chain(&near_gone) {
            let d = (self.points[*v as usize] - target).norm();
            if d > longest * self.wanted(*v, keep) && d > self.edge(*v, keep).max(self.edge(*v, gone)) {
                return false;
            }
        }
        let mut moved = self.around[keep as usize].clone();
        moved.extend(&self.around[gone as usize]);
        for f in moved {
            let Some(face) = self.faces[f as usize] else { continue };
            if shared.contains(&f) {
                continue;
            }
            let before = self.normal(face);
            let p = face.map(|v| if v == keep || v == gone { target } else { self.points[v as usize] });
            let after = (p[1] - p[0]).cross(&(p[2] - p[0]));
            if after.norm() < 1e-12 || before.dot(&after) < 0.5 * before.norm() * after.norm() {
                return false;
            }
        }
        self.points[keep as usize] = target;
        for f in shared {
            if let Some(face) = self.faces[f as usize].take() {
                for v in face {
                    self.around[v as usize].retain(|x| *x != f);
                }
            }
        }
        let rest = std::mem::take(&mut self.around[gone as usize]);
        for f in rest {
            if let Some(face) = &mut self.faces[f as usize] {
                face.iter_mut().filter(|v| **v == gone).for_each(|v| *v = keep);
                self.around[keep as usize].push(f);
            }
        }
        true
    }

    /// Flips edges where that brings valences nearer to six (four on the border) and keeps the surface.
    fn flip(&mut self) {
        for f in 0..self.faces.len() {
            let Some(face) = self.faces[f] else { continue };
            for k in 0..3 {
                let (a, b, c) = (face[k], face[(k + 1) % 3], face[(k + 2) % 3]);
                let shared = self.faces_with(a, b);
                let [f0, f1] = shared[..] else { continue };
                let g = if f0 as usize == f { f1 } else { f0 };
                let Some(other) = self.faces[g as usize] else { continue };
                let Some(&d) = other.iter().find(|v| **v != a && **v != b) else { continue };
                if self.on_plane(c) && self.on_plane(d) || c == d || !self.faces_with(c, d).is_empty() {
                    continue;
                }
                let miss = |v: u32, change: i32| {
                    let best = if self.on_plane(v) { 3 } else { 6 };
                    let n = self.around[v as usize].len() as i32 + change;
                    (n - best) * (n - best)
                };
                let before = miss(a, 0) + miss(b, 0) + miss(c, 0) + miss(d, 0);
                let after = miss(a, -1) + miss(b, -1) + miss(c, 1) + miss(d, 1);
                if after >= before {
                    continue;
                }
                let (n0, n1) = (self.normal(face), self.normal(other));
                let (m0, m1) = (self.normal([c, a, d]), self.normal([d, b, c]));
                let sum = (n0 + n1).normalize();
                if m0.dot(&sum) < 0.7 * m0.norm()
                    || m1.dot(&sum) < 0.7 * m1.norm()
                    || m0.norm() < 1e-10
                    || m1.norm() < 1e-10
                {
                    continue;
                }
                self.faces[f] = Some([c, a, d]);
                self.faces[g as usize] = Some([d, b, c]);
                self.around[a as usize].retain(|x| *x != g);
                self.around[b as usize].retain(|x| *x != f as u32);
                self.around[c as usize].push(g);
                self.around[d as usize].push(f as u32);
                break;
            }
        }
    }

    /// Moves vertices towards their neighbours' area-weighted middle, in the tangent plane, and back to the surface.
    fn relax(&mut self, rounds: usize) {
        for _ in 0..rounds {
            let mut next = self.points.clone();
            for v in 0..self.points.len() as u32 {
                if self.around[v as usize].is_empty() {
                    continue;
                }
                let p = self.points[v as usize];
                let target = if p.x == 0.0 { self.border_middle(v) } else { self.weighted_middle(v) };
                let normal = self.field.gradient(&p).try_normalize(1e-9).unwrap_or_else(Vec3::zeros);
                let step = target - p;
                let mut q = p + 0.6 * (step - normal * normal.dot(&step));
                // Inner vertices keep off the plane, or they would nearly meet their mirror images.
                let off = 0.4 * self.size[v as usize];
                q.x = if p.x == 0.0 { 0.0 } else { q.x.max(off) };
                let q = self.field.project(&q, 3);
                next[v as usize] = if p.x == 0.0 || q.x > 0.25 * self.size[v as usize] { q } else { p };
            }
            self.points = next;
        }
    }

    fn weighted_middle(&self, v: u32) -> Vec3 {
        let (mut sum, mut total) = (Vec3::zeros(), 0.0);
        for face in self.around[v as usize].iter().filter_map(|f| self.faces[*f as usize]) {
            let middle = face.iter().map(|w| self.points[*w as usize]).sum::<Vec3>() / 3.0;
            let size = face.iter().map(|w| self.size[*w as usize]).sum::<f64>() / 3.0;
            // Large faces pull, measured against the size wanted there.
            let weight = self.normal(face).norm() / (size * size);
            sum += middle * weight;
            total += weight;
        }
        if total > 0.0 { sum / total } else { self.points[v as usize] }
    }

    fn border_middle(&self, v: u32) -> Vec3 {
        let near: Vec<u32> =
            self.neighbours(v).into_iter().filter(|w| self.on_plane(*w) && self.faces_with(v, *w).len() == 1).collect();
        let [a, b] = near[..] else { return self.points[v as usize] };
        // Springs whose rest lengths are the wanted ones: the two edges settle in that ratio.
        let (wa, wb) = (1.0 / self.wanted(v, a), 1.0 / self.wanted(v, b));
        (self.points[a as usize] * wa + self.points[b as usize] * wb) / (wa + wb)
    }

    fn smooth_sizes(&mut self) {
        for _ in 0..3 {
            let next: Vec<f64> = (0..self.points.len() as u32)
                .map(|v| {
                    let near = self.neighbours(v);
                    if near.is_empty() {
                        return self.size[v as usize];
                    }
                    let mean = near.iter().map(|w| self.size[*w as usize]).sum::<f64>() / near.len() as f64;
                    0.5 * (self.size[v as usize] + mean)
                })
                .collect();
            self.size = next;
        }
    }

    fn compact(self) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let mut new = vec![u32::MAX; self.points.len()];
        let mut points = Vec::new();
        let mut faces = Vec::new();
        for face in self.faces.into_iter().flatten() {
            faces.push(face.map(|v| {
                if new[v as usize] == u32::MAX {
                    new[v as usize] = points.len() as u32;
                    points.push(self.points[v as usize]);
                }
                new[v as usize]
            }));
        }
        (points, faces)
    }
}
