//! Moves the vertices of the quads along the surface, so that the quads become squares.

use super::flat_quads::without_flat_quads;
use super::quality::quad_quality_deg;
use super::subdivision::Quads;
use super::surface::{Lists, Surface};
use crate::geometry::{Point, Vec3};

/// Rounds of relaxation: after 12 the angles hardly change.
const ROUNDS: usize = 12;

/// Quads of a lower quality than this are improved one by one, in degrees.
const POOR_DEG: f64 = 40.0;

/// Quads of a lower quality than this are removed if repairs do not help, in degrees.
const FLAT_DEG: f64 = 25.0;

/// The least cosine between the normals of two corners that become one, as where triangles are collapsed.
const LEAST_COS: f64 = 0.3;

/// Whatever their normals, corners nearer than this share of the edge length become one, as in crumpled cloth.
const CREASE_PER_EDGE_LENGTH: f64 = 0.5;

/// Rounds of removals.
const REMOVALS: usize = 10;

/// Rounds over the poor quads after each round of removals.
const REPAIRS_AFTER_REMOVAL: usize = 3;

/// Rounds over the poor quads.
const REPAIRS: usize = 12;

/// A border that leaves the straight line between two vertices by more than this gets a vertex there, in metres.
const LEFT_BY: f64 = 0.3e-3;

/// The quads on the surface.
pub(super) struct Relaxation<'a> {
    surface: &'a Surface,
    quads: Quads,
    quads_of: Lists,
}

/// Squares as far as possible, with all vertices on the surface and those of borders on the borders.
pub(super) fn relaxed(surface: &Surface, quads: Quads, edge_length: f64) -> Quads {
    let mut all = Relaxation::of(surface, quads);
    for round in 0..ROUNDS {
        all.relax();
        if round == ROUNDS / 2 || round == ROUNDS - 3 {
            all.keep_turns_of_borders();
        }
    }
    all.repair_all(REPAIRS);
    for _ in 0..REMOVALS {
        let may_join = |a: u32, c: u32| !all.is_around_tip(a as usize, c as usize, edge_length);
        let Some(fewer) = without_flat_quads(&all.quads, &all.flat_quads(), &may_join) else { break };
        all = Relaxation::of(surface, fewer);
        (0..3).for_each(|_| all.relax());
        all.repair_all(REPAIRS_AFTER_REMOVAL);
    }
    all.quads
}

impl<'a> Relaxation<'a> {
    fn of(surface: &'a Surface, quads: Quads) -> Self {
        let pairs: Vec<(u32, u32)> = (0u32..).zip(&quads.quads).flat_map(|(q, quad)| quad.map(|v| (v, q))).collect();
        let quads_of = Lists::of(quads.points.len(), &pairs);
        let mut all = Self { surface, quads, quads_of };
        for v in 0..all.quads.points.len() {
            all.put(v, all.quads.points[v]);
        }
        all
    }

    fn repair_all(&mut self, rounds: usize) {
        for _ in 0..rounds {
            if !self.repair() {
                break;
            }
        }
    }

    /// Whether two vertices lie on different sides of a finger, and not only of a crease.
    fn is_around_tip(&self, a: usize, c: usize, edge_length: f64) -> bool {
        let distance = (self.quads.points[a] - self.quads.points[c]).norm();
        self.normal(a).dot(&self.normal(c)) < LEAST_COS && distance > CREASE_PER_EDGE_LENGTH * edge_length
    }

    /// The quads that repairs left flat or folded, the worst first.
    fn flat_quads(&self) -> Vec<u32> {
        let mut flat: Vec<(f64, u32)> = (0..self.quads.quads.len())
            .map(|q| (self.quality(q), q as u32))
            .filter(|(quality, _)| *quality < FLAT_DEG)
            .collect();
        flat.sort_unstable_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        flat.into_iter().map(|(_, q)| q).collect()
    }

    /// Every vertex moves to the mean of its places in squares that fit the quads around it.
    fn relax(&mut self) {
        let mut sums = vec![Vec3::zeros(); self.quads.points.len()];
        for quad in &self.quads.quads {
            let corners = quad.map(|v| self.quads.points[v as usize]);
            for (v, p) in quad.iter().zip(square_at(&corners)) {
                sums[*v as usize] += p.coords;
            }
        }
        for (v, sum) in sums.iter().enumerate() {
            let count = self.quads_of.get(v).len().max(1) as f64;
            self.put(v, Point::from(sum / count));
        }
    }

    /// Moves a vertex to the place on the surface, or on its border, next to `to`.
    fn put(&mut self, v: usize, to: Point) {
        if let Some(place) = self.quads.on_border[v] {
            if !place.is_corner {
                let (place, point) = self.along_border(v, &to);
                self.quads.on_border[v] = Some(place);
                self.quads.points[v] = point;
            }
            return;
        }
        let (face, point) = self.surface.closest_from(self.quads.on_face[v], &to);
        self.quads.on_face[v] = face;
        self.quads.points[v] = point;
    }

    /// Moves vertices of borders to where the border leaves the straight lines between them most, and keeps them there.
    fn keep_turns_of_borders(&mut self) {
        let sides: std::collections::HashSet<[u32; 2]> =
            self.quads.quads.iter().flat_map(|q| (0..4).map(|k| [q[k], q[(k + 1) % 4]])).collect();
        for q in 0..self.quads.quads.len() {
            let quad = self.quads.quads[q];
            for k in 0..4 {
                let [a, b] = [quad[k], quad[(k + 1) % 4]];
                if !sides.contains(&[b, a]) {
                    self.keep_turn_between(a as usize, b as usize);
                }
            }
        }
    }

    fn keep_turn_between(&mut self, a: usize, b: usize) {
        let (Some(p), Some(q)) = (self.quads.on_border[a], self.quads.on_border[b]) else { return };
        let (distance, at) = self.surface.borders.farthest_between(&p, &q);
        if distance < LEFT_BY {
            return;
        }
        let turn = self.surface.borders.moved(&p, at);
        let (near, place) = if at < 0.5 * self.surface.borders.way_forwards(&p, &q) { (a, p) } else { (b, q) };
        if !place.is_corner {
            self.quads.on_border[near] = Some(super::borders::OnBorder { is_corner: true, ..turn });
            self.quads.points[near] = self.surface.borders.point(&turn);
        }
    }

    fn along_border(&self, v: usize, to: &Point) -> (super::borders::OnBorder, Point) {
        let borders = &self.surface.borders;
        let place = self.quads.on_border[v].expect("asked for vertices of borders only");
        let by = borders.tangent(&place).dot(&(to - self.quads.points[v]));
        // Never past the neighbours on the border.
        let (mut back, mut forth) = (f64::INFINITY, f64::INFINITY);
        for &q in self.quads_of.get(v) {
            for &w in &self.quads.quads[q as usize] {
                if let Some(other) =
                    self.quads.on_border[w as usize].filter(|o| o.curve == place.curve && w as usize != v)
                {
                    let way = borders.way(&place, &other);
                    if way >= 0.0 { forth = forth.min(way) } else { back = back.min(-way) }
                }
            }
        }
        let by = by.clamp(-0.3 * back.min(1.0), 0.3 * forth.min(1.0));
        let moved = borders.moved(&place, by);
        (moved, borders.point(&moved))
    }

    /// Searches better places for the corners of poor quads; whether any was found.
    fn repair(&mut self) -> bool {
        let mut has_improved = false;
        for q in 0..self.quads.quads.len() {
            if self.quality(q) >= POOR_DEG {
                continue;
            }
            for v in self.quads.quads[q] {
                has_improved |= self.improve(v as usize);
            }
        }
        has_improved
    }

    fn improve(&mut self, v: usize) -> bool {
        let [q, ..] = self.quads_of.get(v) else { return false };
        let corners = self.quads.quads[*q as usize].map(|w| self.quads.points[w as usize]);
        let length = 0.25 * (0..4).map(|k| (corners[(k + 1) % 4] - corners[k]).norm()).sum::<f64>();
        let normal = self.normal(v);
        let x = super::orientation_field::tangent_of(&(corners[1] - corners[0]), &normal);
        let y = normal.cross(&x);
        let mut best = self.worst_at(v);
        let mut has_improved = false;
        for step in [0.3, 0.12, 0.04] {
            for k in 0..8 {
                let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
                let before = (self.quads.points[v], self.quads.on_border[v], self.quads.on_face[v]);
                self.put(v, before.0 + (x * cos + y * sin) * (step * length));
                let now = self.worst_at(v);
                if now > best + 0.01 {
                    best = now;
                    has_improved = true;
                } else {
                    (self.quads.points[v], self.quads.on_border[v], self.quads.on_face[v]) = before;
                }
            }
        }
        has_improved
    }

    fn normal(&self, v: usize) -> Vec3 {
        self.surface.normal_of_face(self.quads.on_face[v])
    }

    fn worst_at(&self, v: usize) -> f64 {
        self.quads_of.get(v).iter().map(|&q| self.quality(q as usize)).fold(180.0, f64::min)
    }

    fn quality(&self, q: usize) -> f64 {
        let quad = self.quads.quads[q];
        let normal: Vec3 = quad.iter().map(|&v| self.normal(v as usize)).sum();
        quad_quality_deg(&quad.map(|v| self.quads.points[v as usize]), &normal)
    }
}

/// The corners of the square that fits a quad best.
fn square_at(quad: &[Point; 4]) -> [Point; 4] {
    let center = Point::from(quad.iter().map(|p| p.coords).sum::<Vec3>() / 4.0);
    let (e, f) = (0.5 * (quad[0] - quad[2]), 0.5 * (quad[1] - quad[3]));
    let Some(normal) = e.cross(&f).try_normalize(1e-300) else { return *quad };
    let u = 0.5 * (e + f.cross(&normal));
    let v = normal.cross(&u);
    [center + u, center + v, center - u, center - v]
}
