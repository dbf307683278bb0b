//! Contracts a surface to the points of the lattice: whatever shares a lattice point becomes one vertex.
//!
//! Jakob et al. 2015 extract a graph and search its faces. We collapse the edges of the triangles instead, as long as the
//! surface stays manifold: holes and small handles survive, and only cost a few triangles.

use super::borders::{Borders, OnBorder};
use super::surface::Surface;
use crate::geometry::{Point, Vec3};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Edges shorter than this share of the spacing are collapsed: those of the lattice have 1, those at its faults about 0.7.
const SHORT: f64 = 0.62;

/// Edges longer than this share of the spacing are split; a diagonal of the lattice has 1.41.
const LONG: f64 = 1.75;

/// The least cosine between the normals of two vertices that become one, 72°: fingers keep at least five vertices around them.
const LEAST_COS: f64 = 0.3;

/// The widest spread of the normals around a vertex of a solid, in radians, 75°; cloth has creases. With averages alone the tips of fingers would turn to
/// the side, step by step, and be taken in by it.
const WIDEST_SPREAD: f64 = 1.3;

/// Whatever their normals, vertices nearer than this share of the spacing become one: crumpled cloth has such creases.
const CREASE: f64 = 0.05;

/// The least cosine between the normals of a vertex and of its lattice point.
const LEAST_COS_OF_MOVE: f64 = 0.5;

/// Passes over all edges; collapses that would pinch the surface often become possible in the next one.
const PASSES: usize = 8;

/// Neighbours on a border are at least so far apart, as a share of the spacing.
const LEAST_GAP: f64 = 0.25;

/// Rounds of repairs: later ones change nothing.
const REPAIRS: usize = 5;

/// The sum of the angles opposite to an edge, in degrees, from which the edge is flipped. Delaunay's 180 would flip the
/// diagonals of squares to and fro.
const FLIPPED_FROM_DEG: f64 = 195.0;

/// Triangles between lattice points.
pub(super) struct Contraction<'a> {
    surface: &'a Surface,
    borders: &'a Borders,
    /// Of the lattice at each vertex, in metres.
    spacings: Vec<f64>,
    pub points: Vec<Point>,
    pub normals: Vec<Vec3>,
    areas: Vec<f64>,
    /// The greatest angle, in radians, between the normal of each vertex and those that it had or took in.
    spreads: Vec<f64>,
    pub on_border: Vec<Option<OnBorder>>,
    /// The face of the surface on which each vertex lies.
    pub on_face: Vec<u32>,
    /// `None` once collapsed.
    pub(super) faces: Vec<Option<[u32; 3]>>,
    pub(super) faces_of: Vec<Vec<u32>>,
    /// Changes with each move of a vertex.
    stamp: Vec<u32>,
}

/// The bits of an edge's length, its vertices, and how often each had changed.
type ShortEdge = (u64, u32, u32, [u32; 2]);

impl<'a> Contraction<'a> {
    /// Collapses all short edges and repairs what is left between them.
    pub fn of(surface: &'a Surface, lattice: &[Point], spacings: &[f64]) -> Self {
        let mut all = Self {
            surface,
            borders: &surface.borders,
            spacings: spacings.to_vec(),
            points: lattice.to_vec(),
            normals: surface.normals.clone(),
            areas: surface.areas.clone(),
            spreads: vec![0.0; lattice.len()],
            on_border: surface.borders.of_vertex.clone(),
            on_face: (0..lattice.len()).map(|v| surface.faces_of.get(v)[0]).collect(),
            faces: surface.faces.iter().copied().map(Some).collect(),
            faces_of: (0..lattice.len()).map(|v| surface.faces_of.get(v).to_vec()).collect(),
            stamp: vec![0; lattice.len()],
        };
        for (v, place) in surface.borders.of_vertex.iter().enumerate() {
            let Some(place) = place else { continue };
            let by = all.borders.tangent(place).dot(&(lattice[v] - surface.points[v]));
            let moved = if place.is_corner { *place } else { all.borders.moved_to_corner_at_most(place, by) };
            all.points[v] = all.borders.point(&moved);
            all.on_border[v] = Some(moved);
        }
        for (v, place) in lattice.iter().enumerate() {
            if all.on_border[v].is_none() {
                let (face, point) = surface.closest_from(all.on_face[v], place);
                // Around a finger the lattice point of a vertex may lie on the other side.
                if surface.normal_of_face(face).dot(&surface.normals[v]) > LEAST_COS_OF_MOVE {
                    (all.on_face[v], all.points[v]) = (face, point);
                } else {
                    all.points[v] = surface.points[v];
                }
            }
        }
        all.collapse_short_edges();
        all.points.clone().into_iter().enumerate().for_each(|(v, p)| all.put(v, p));
        for _ in 0..REPAIRS {
            all.repair();
        }
        for _ in 0..REPAIRS {
            if !all.close_small_handles() {
                break;
            }
            all.repair();
        }
        all.flip_edges();
        all.order_borders();
        all
    }

    fn repair(&mut self) {
        self.remove_vertices_with_three_faces();
        self.split_long_edges();
        self.flip_edges();
        self.unfold();
        self.collapse_short_edges();
    }

    /// The triangles that are left.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        self.faces.iter().flatten().copied().collect()
    }

    pub(super) fn corners(&self, f: u32) -> [u32; 3] {
        self.faces[f as usize].expect("lists of faces hold those that are left")
    }

    pub(super) fn neighbours(&self, v: u32) -> Vec<u32> {
        let mut around: Vec<u32> =
            self.faces_of[v as usize].iter().flat_map(|&f| self.corners(f)).filter(|&w| w != v).collect();
        around.sort_unstable();
        around.dedup();
        around
    }

    pub(super) fn faces_of_edge(&self, a: u32, b: u32) -> Vec<u32> {
        self.faces_of[a as usize].iter().copied().filter(|&f| self.corners(f).contains(&b)).collect()
    }

    pub(super) fn third(&self, f: u32, a: u32, b: u32) -> u32 {
        self.corners(f).into_iter().find(|&v| v != a && v != b).unwrap_or(a)
    }

    pub(super) fn is_border(&self, v: u32) -> bool {
        self.on_border[v as usize].is_some()
    }

    fn is_corner(&self, v: u32) -> bool {
        self.on_border[v as usize].is_some_and(|place| place.is_corner)
    }

    /// Whether two vertices lie on different sides of a finger, and not only of a crease.
    fn is_around_tip(&self, a: u32, b: u32) -> bool {
        let cos = self.normals[a as usize].dot(&self.normals[b as usize]);
        cos < LEAST_COS && self.length(a, b) > CREASE * self.spacing(a, b)
    }

    /// Of the lattice between two vertices.
    pub(super) fn spacing(&self, a: u32, b: u32) -> f64 {
        0.5 * (self.spacings[a as usize] + self.spacings[b as usize])
    }

    pub(super) fn length(&self, a: u32, b: u32) -> f64 {
        (self.points[a as usize] - self.points[b as usize]).norm()
    }

    /// Every edge once, ascending.
    pub(super) fn edges(&self) -> Vec<[u32; 2]> {
        let sides = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]];
        let mut edges: Vec<[u32; 2]> =
            self.faces.iter().flatten().flat_map(|&f| sides(f)).map(|[a, b]| [a.min(b), a.max(b)]).collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    fn collapse_short_edges(&mut self) {
        for _ in 0..PASSES {
            let mut heap = BinaryHeap::new();
            self.edges().into_iter().for_each(|[a, b]| self.push(&mut heap, a, b));
            let mut count = 0;
            while let Some(Reverse((_, a, b, stamps))) = heap.pop() {
                if stamps == self.stamps(a, b) && self.collapse(a, b) {
                    count += 1;
                    self.neighbours(a).into_iter().for_each(|w| self.push(&mut heap, a, w));
                }
            }
            if count == 0 {
                return;
            }
        }
    }

    fn push(&self, heap: &mut BinaryHeap<Reverse<ShortEdge>>, a: u32, b: u32) {
        // Those on the border stay, so they come first.
        let (a, b) =
            if self.rank(b) > self.rank(a) || (self.rank(a) == self.rank(b) && b < a) { (b, a) } else { (a, b) };
        let length = self.length(a, b);
        if length < SHORT * self.spacing(a, b) {
            heap.push(Reverse((length.to_bits(), a, b, self.stamps(a, b))));
        }
    }

    fn stamps(&self, a: u32, b: u32) -> [u32; 2] {
        [self.stamp[a as usize], self.stamp[b as usize]]
    }

    fn rank(&self, v: u32) -> u8 {
        u8::from(self.is_border(v)) + u8::from(self.is_corner(v))
    }

    /// Moves `b` into `a`, if the surface stays manifold and no triangle turns over.
    fn collapse(&mut self, a: u32, b: u32) -> bool {
        let shared = self.faces_of_edge(a, b);
        if shared.is_empty() || self.is_around_tip(a, b) || !self.keeps_topology(a, b, &shared) {
            return false;
        }
        let (normal, spread) = self.merged_normal(a, b);
        if self.surface.is_solid && spread > WIDEST_SPREAD && self.length(a, b) > CREASE * self.spacing(a, b) {
            return false;
        }
        let (point, place) = self.merged_place(a, b);
        if self.turns_over(a, b, &point) {
            return false;
        }
        for &f in &shared {
            for v in self.corners(f) {
                self.faces_of[v as usize].retain(|&g| g != f);
            }
            self.faces[f as usize] = None;
        }
        for f in std::mem::take(&mut self.faces_of[b as usize]) {
            self.faces[f as usize] = self.faces[f as usize].map(|corners| corners.map(|v| if v == b { a } else { v }));
            self.faces_of[a as usize].push(f);
        }
        self.faces_of[a as usize].sort_unstable();
        let [i, j] = [a as usize, b as usize];
        (self.normals[i], self.spreads[i]) = (normal, spread);
        self.spacings[i] = self.spacing(a, b);
        self.areas[i] += self.areas[j];
        self.points[i] = point;
        self.on_border[i] = place;
        self.stamp[i] += 1;
        self.stamp[j] += 1;
        true
    }

    /// The link condition, and at least three faces around each vertex (two on a border).
    ///
    /// **Source** Dey et al. 1999.
    fn keeps_topology(&self, a: u32, b: u32, shared: &[u32]) -> bool {
        let both_on_border = self.is_border(a) && self.is_border(b);
        if (both_on_border && shared.len() > 1) || (self.is_corner(a) && self.is_corner(b)) {
            return false;
        }
        let around_b = self.neighbours(b);
        let common = self.neighbours(a).iter().filter(|v| around_b.binary_search(v).is_ok()).count();
        let keeps_enough = |&f: &u32| {
            let opposite = self.third(f, a, b);
            self.faces_of[opposite as usize].len() > self.least_faces(opposite)
        };
        common == shared.len() && shared.iter().all(keeps_enough)
    }

    /// The least number of faces around a vertex: with fewer there were no good angles.
    fn least_faces(&self, v: u32) -> usize {
        match self.on_border[v as usize] {
            None => 3,
            Some(place) if place.is_corner => 1,
            Some(_) => 2,
        }
    }

    fn merged_normal(&self, a: u32, b: u32) -> (Vec3, f64) {
        let [i, j] = [a as usize, b as usize];
        let sum = self.normals[i] * self.areas[i] + self.normals[j] * self.areas[j];
        let normal = sum.try_normalize(1e-300).unwrap_or(self.normals[i]);
        let spread = |v: usize| self.spreads[v] + normal.dot(&self.normals[v]).clamp(-1.0, 1.0).acos();
        (normal, spread(i).max(spread(j)))
    }

    fn merged_place(&self, a: u32, b: u32) -> (Point, Option<OnBorder>) {
        let [i, j] = [a as usize, b as usize];
        let share = self.areas[j] / (self.areas[i] + self.areas[j]);
        match (self.on_border[i], self.on_border[j]) {
            (Some(own), Some(other)) if !own.is_corner => {
                let moved = self.borders.moved(&own, share * self.borders.way(&own, &other));
                (self.borders.point(&moved), Some(moved))
            }
            (Some(own), _) => (self.points[i], Some(own)),
            _ => (self.points[i] + (self.points[j] - self.points[i]) * share, None),
        }
    }

    /// Whether a face would point away from the surface that does not now.
    fn turns_over(&self, a: u32, b: u32, to: &Point) -> bool {
        let bad = |f: &u32, moving: u32| {
            let corners = self.corners(*f);
            if corners.contains(&a) && corners.contains(&b) {
                return false;
            }
            let now = corners.map(|v| self.points[v as usize]);
            let then = corners.map(|v| if v == moving { *to } else { self.points[v as usize] });
            let normal: Vec3 = corners.iter().map(|&v| self.normals[v as usize]).sum();
            let [before, after] = [now, then].map(|[p, q, r]| (q - p).cross(&(r - p)).dot(&normal));
            after < -0.5 * self.spacing(a, b).powi(2) && after < before
        };
        self.faces_of[a as usize].iter().any(|f| bad(f, a)) || self.faces_of[b as usize].iter().any(|f| bad(f, b))
    }

    /// Puts the vertices of each border in the order of its edges, and apart.
    fn order_borders(&mut self) {
        let sides: std::collections::HashSet<[u32; 2]> =
            self.triangles().into_iter().flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
        let on_border = |[a, b]: &[u32; 2]| !sides.contains(&[*b, *a]);
        let mut next: std::collections::BTreeMap<u32, u32> =
            sides.iter().filter(|side| on_border(side)).map(|&[a, b]| (a, b)).collect();
        while let Some((first, mut at)) = next.pop_first() {
            let mut ring = vec![first];
            while at != first {
                ring.push(at);
                at = next.remove(&at).unwrap_or(first);
            }
            let places: Vec<OnBorder> = ring.iter().filter_map(|&v| self.on_border[v as usize]).collect();
            for (&v, place) in
                ring.iter().zip(self.borders.in_order(&places, LEAST_GAP * self.spacings[first as usize]))
            {
                self.points[v as usize] = self.borders.point(&place);
                self.on_border[v as usize] = Some(place);
            }
        }
    }

    /// Moves a vertex to the surface next to `to`; those of borders stay.
    fn put(&mut self, v: usize, to: Point) {
        if self.on_border[v].is_none() && !self.faces_of[v].is_empty() {
            (self.on_face[v], self.points[v]) = self.surface.closest_from(self.on_face[v], &to);
            self.normals[v] = self.surface.normal_of_face(self.on_face[v]);
            self.stamp[v] += 1;
        }
    }

    /// Moves the corners of triangles that are folded or flat towards their neighbours.
    fn unfold(&mut self) {
        for _ in 0..4 {
            let mut corners: Vec<u32> = self.triangles().into_iter().filter(|t| self.is_poor(t)).flatten().collect();
            corners.sort_unstable();
            corners.dedup();
            if corners.is_empty() {
                return;
            }
            for v in corners {
                let around = self.neighbours(v);
                // The tips of fingers would slide back.
                if around.iter().any(|&w| self.is_around_tip(v, w)) {
                    continue;
                }
                let mean = around.iter().map(|&w| self.points[w as usize].coords).sum::<Vec3>() / around.len() as f64;
                self.put(v as usize, Point::from(mean));
            }
        }
    }

    /// Whether a triangle is folded over or has an angle of less than 15°.
    fn is_poor(&self, triangle: &[u32; 3]) -> bool {
        let [p, q, r] = triangle.map(|v| self.points[v as usize]);
        let normal: Vec3 = triangle.iter().map(|&v| self.normals[v as usize]).sum();
        let area = (q - p).cross(&(r - p));
        let longest = (q - p).norm_squared().max((r - q).norm_squared()).max((p - r).norm_squared());
        area.dot(&normal) <= 0.0 || area.norm() < 0.25 * longest
    }

    /// A vertex with three faces around it makes flat triangles: one face is better.
    fn remove_vertices_with_three_faces(&mut self) {
        for v in 0..self.points.len() as u32 {
            if self.faces_of[v as usize].len() == 3 && !self.is_border(v) {
                let around = self.neighbours(v);
                let nearest = around.into_iter().min_by(|&a, &b| self.length(a, v).total_cmp(&self.length(b, v)));
                if let Some(a) = nearest {
                    let before = self.points[v as usize];
                    self.points[v as usize] = self.points[a as usize];
                    if !self.collapse(a, v) {
                        self.points[v as usize] = before;
                    }
                }
            }
        }
    }

    fn split_long_edges(&mut self) {
        for [a, b] in self.edges() {
            if self.length(a, b) > LONG * self.spacing(a, b) {
                self.split(a, b);
            }
        }
    }

    /// Another vertex at the place of one inside of the surface, without faces.
    pub(super) fn double(&mut self, v: u32) -> u32 {
        let i = v as usize;
        self.points.push(self.points[i]);
        self.normals.push(self.normals[i]);
        self.areas.push(self.areas[i]);
        self.spreads.push(self.spreads[i]);
        self.spacings.push(self.spacings[i]);
        self.on_border.push(None);
        self.on_face.push(self.on_face[i]);
        self.stamp.push(0);
        self.faces_of.push(Vec::new());
        self.points.len() as u32 - 1
    }

    fn split(&mut self, a: u32, b: u32) {
        let shared = self.faces_of_edge(a, b);
        let m = self.points.len() as u32;
        let [i, j] = [a as usize, b as usize];
        let mut place = None;
        let mut point = nalgebra::center(&self.points[i], &self.points[j]);
        if let (1, Some(p), Some(q)) = (shared.len(), &self.on_border[i], &self.on_border[j]) {
            let middle = self.borders.moved(p, 0.5 * self.borders.way(p, q));
            point = self.borders.point(&middle);
            place = Some(middle);
        }
        self.points.push(point);
        self.normals.push((self.normals[i] + self.normals[j]).try_normalize(1e-9).unwrap_or(self.normals[i]));
        self.areas.push(0.5 * (self.areas[i] + self.areas[j]));
        self.spreads.push(self.spreads[i].max(self.spreads[j]));
        self.spacings.push(self.spacing(a, b));
        self.on_border.push(place);
        self.on_face.push(self.on_face[i]);
        self.stamp.push(0);
        self.faces_of.push(Vec::new());
        for f in shared {
            let corners = self.corners(f);
            let c = self.third(f, a, b);
            let g = self.faces.len() as u32;
            self.faces[f as usize] = Some(corners.map(|v| if v == b { m } else { v }));
            self.faces.push(Some(corners.map(|v| if v == a { m } else { v })));
            self.faces_of[j].retain(|&h| h != f);
            self.faces_of[j].push(g);
            self.faces_of[c as usize].push(g);
            self.faces_of[m as usize].extend([f, g]);
        }
    }

    fn flip_edges(&mut self) {
        for _ in 0..4 {
            let mut count = 0;
            for [a, b] in self.edges() {
                count += usize::from(self.flip(a, b));
            }
            if count == 0 {
                return;
            }
        }
    }

    fn flip(&mut self, a: u32, b: u32) -> bool {
        let shared = self.faces_of_edge(a, b);
        let &[f, g] = shared.as_slice() else { return false };
        let [c, d] = [f, g].map(|face| self.third(face, a, b));
        let at = |v: u32| self.points[v as usize];
        let angle = |tip: u32| (at(a) - at(tip)).angle(&(at(b) - at(tip))).to_degrees();
        if angle(c) + angle(d) < FLIPPED_FROM_DEG || !self.faces_of_edge(c, d).is_empty() {
            return false;
        }
        let stays = |v: u32| self.faces_of[v as usize].len() > self.least_faces(v);
        if !stays(a) || !stays(b) {
            return false;
        }
        // As the face f walks them: a, b, c or b, a, c.
        let corners = self.corners(f);
        let first = corners.iter().position(|&v| v == a).unwrap_or(0);
        let (a, b) = if corners[(first + 1) % 3] == b { (a, b) } else { (b, a) };
        let flipped = [[a, d, c], [d, b, c]];
        let points_away = |face: &[u32; 3]| {
            let [p, q, r] = face.map(at);
            let normal: Vec3 = face.iter().map(|&v| self.normals[v as usize]).sum();
            (q - p).cross(&(r - p)).dot(&normal) <= 0.0
        };
        if flipped.iter().any(points_away) {
            return false;
        }
        [self.faces[f as usize], self.faces[g as usize]] = flipped.map(Some);
        self.faces_of[a as usize].retain(|&h| h != g);
        self.faces_of[b as usize].retain(|&h| h != f);
        self.faces_of[c as usize].push(g);
        self.faces_of[d as usize].push(f);
        true
    }
}
