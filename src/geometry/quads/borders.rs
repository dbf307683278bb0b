//! Borders of a surface as closed curves, on which the vertices of the quads stay.

use crate::geometry::{Point, Vec3};
use std::collections::{HashMap, HashSet};

/// A place on a border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OnBorder {
    pub curve: u32,
    /// Length along the curve, in metres, from 0 to the curve's length.
    pub at: f64,
    /// Corners, for example at the upper end of a slit, stay vertices.
    pub is_corner: bool,
}

/// All borders.
pub(super) struct Borders {
    pub curves: Vec<Curve>,
    /// Where each vertex of the surface lies on a border, if it does.
    pub of_vertex: Vec<Option<OnBorder>>,
}

/// A closed curve of straight pieces.
pub(super) struct Curve {
    pub points: Vec<Point>,
    /// Length before each point; one more than points, the last is the whole length.
    pub lengths: Vec<f64>,
    /// Where its corners are.
    corners: Vec<f64>,
}

/// Length in metres along the border on both sides of a point over which its turn is measured: shorter zigzags are no corners.
const REACH: f64 = 0.012;

/// The turn of a border, in degrees, from which it is a corner: slits and plackets turn by 90, worn hems by less than 40.
const CORNER_DEG: f64 = 55.0;

/// Passes that put places in order; each moves only two.
const ORDERINGS: usize = 30;

impl Borders {
    /// **Requires** a manifold surface with one fan of faces per vertex.
    pub fn of(points: &[Point], faces: &[[u32; 3]]) -> Self {
        let sides: HashSet<[u32; 2]> = faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
        let mut next: HashMap<u32, u32> = HashMap::new();
        let mut starts = Vec::new();
        for &[a, b, c] in faces {
            for [a, b] in [[a, b], [b, c], [c, a]] {
                if !sides.contains(&[b, a]) {
                    next.insert(a, b);
                    starts.push(a);
                }
            }
        }
        let mut borders = Self { curves: Vec::new(), of_vertex: vec![None; points.len()] };
        for start in starts {
            if borders.of_vertex[start as usize].is_some() {
                continue;
            }
            let mut ring = vec![start];
            let mut at = next[&start];
            while at != start {
                ring.push(at);
                at = next[&at];
            }
            borders.add(points, &ring);
        }
        borders
    }

    fn add(&mut self, points: &[Point], ring: &[u32]) {
        let mut curve = Curve::through(ring.iter().map(|&v| points[v as usize]).collect());
        let corners = curve.turns();
        curve.corners = curve.lengths.iter().zip(&corners).filter(|(_, is)| **is).map(|(at, _)| *at).collect();
        for ((&v, &at), is_corner) in ring.iter().zip(&curve.lengths).zip(corners) {
            self.of_vertex[v as usize] = Some(OnBorder { curve: self.curves.len() as u32, at, is_corner });
        }
        self.curves.push(curve);
    }

    /// The position of a place.
    pub fn point(&self, place: &OnBorder) -> Point {
        self.curves[place.curve as usize].point(place.at)
    }

    /// The unit direction of the border at a place, as seen over a few millimetres.
    pub fn tangent(&self, place: &OnBorder) -> Vec3 {
        let curve = &self.curves[place.curve as usize];
        let reach = (0.5 * REACH).min(0.125 * curve.length());
        let along = curve.point(place.at + reach) - curve.point(place.at - reach);
        along.try_normalize(1e-12).unwrap_or_else(Vec3::x)
    }

    /// The place `by` metres further on; the direction may be negative.
    pub fn moved(&self, place: &OnBorder, by: f64) -> OnBorder {
        let at = (place.at + by).rem_euclid(self.curves[place.curve as usize].length());
        OnBorder { at, is_corner: false, ..*place }
    }

    /// The place `by` metres further on, but never past a corner.
    pub fn moved_to_corner_at_most(&self, place: &OnBorder, by: f64) -> OnBorder {
        let curve = &self.curves[place.curve as usize];
        let ways = curve.corners.iter().map(|&at| (at - place.at).rem_euclid(curve.length()));
        let forwards = ways.clone().fold(f64::INFINITY, f64::min);
        let backwards = ways.map(|way| curve.length() - way).fold(f64::INFINITY, f64::min);
        self.moved(place, by.clamp(-0.9 * backwards, 0.9 * forwards))
    }

    /// Places in the order in which they are given, once around their curve, those next to each other at least `gap` metres
    /// apart where there is room; corners stay.
    ///
    /// **Requires** places on one curve.
    pub fn in_order(&self, places: &[OnBorder], gap: f64) -> Vec<OnBorder> {
        let mut places = places.to_vec();
        let Some(first) = places.first() else { return places };
        let length = self.curves[first.curve as usize].length();
        let gap = gap.min(0.5 * length / places.len() as f64);
        let n = places.len();
        for _ in 0..ORDERINGS {
            let mut is_ordered = true;
            for k in 0..n {
                let [p, q] = [places[k], places[(k + 1) % n]];
                let lacking = gap - self.way(&p, &q);
                if lacking <= 1e-9 || (p.is_corner && q.is_corner) {
                    continue;
                }
                is_ordered = false;
                let share = if p.is_corner {
                    0.0
                } else if q.is_corner {
                    1.0
                } else {
                    0.5
                };
                if !p.is_corner {
                    places[k] = self.moved(&p, -share * lacking);
                }
                if !q.is_corner {
                    places[(k + 1) % n] = self.moved(&q, (1.0 - share) * lacking);
                }
            }
            if is_ordered {
                break;
            }
        }
        let once_around = (0..n).map(|k| self.way_forwards(&places[k], &places[(k + 1) % n])).sum::<f64>();
        if (once_around - length).abs() > 0.5 * length {
            let first = places[0];
            for (k, place) in places.iter_mut().enumerate() {
                *place = self.moved(&first, length * k as f64 / n as f64);
            }
        }
        places
    }

    /// The way along the curve from one place to another, the shorter way round.
    pub fn way(&self, from: &OnBorder, to: &OnBorder) -> f64 {
        let length = self.curves[from.curve as usize].length();
        let way = (to.at - from.at).rem_euclid(length);
        if way > 0.5 * length { way - length } else { way }
    }

    /// How far the border leaves the straight line from one place forwards to another, and how far along the border.
    pub fn farthest_between(&self, from: &OnBorder, to: &OnBorder) -> (f64, f64) {
        let curve = &self.curves[from.curve as usize];
        let (p, q, way) = (self.point(from), self.point(to), self.way_forwards(from, to));
        let along = q - p;
        let first = curve.lengths.partition_point(|&length| length <= from.at);
        let (mut farthest, mut count) = ((0.0, 0.0), curve.points.len());
        let mut k = first % count;
        while count > 0 {
            let at = (curve.lengths[k] - from.at).rem_euclid(curve.length());
            if at >= way {
                break;
            }
            let d = curve.points[k] - p;
            let share = (d.dot(&along) / along.norm_squared().max(1e-18)).clamp(0.0, 1.0);
            let distance = (d - along * share).norm();
            if distance > farthest.0 {
                farthest = (distance, at);
            }
            (k, count) = ((k + 1) % curve.points.len(), count - 1);
        }
        farthest
    }

    /// The way along the curve from one place forwards to another.
    pub fn way_forwards(&self, from: &OnBorder, to: &OnBorder) -> f64 {
        let length = self.curves[from.curve as usize].length();
        let way = (to.at - from.at).rem_euclid(length);
        if way <= 0.0 { length } else { way }
    }
}

impl Curve {
    fn through(points: Vec<Point>) -> Self {
        let mut lengths = vec![0.0];
        for k in 0..points.len() {
            lengths.push(lengths[k] + (points[(k + 1) % points.len()] - points[k]).norm());
        }
        Self { points, lengths, corners: Vec::new() }
    }

    pub fn length(&self) -> f64 {
        self.lengths.last().copied().unwrap_or(0.0).max(1e-12)
    }

    /// The point `at` metres from the beginning, round and round.
    pub fn point(&self, at: f64) -> Point {
        let at = at.rem_euclid(self.length());
        let k = self.lengths.partition_point(|&length| length <= at).clamp(1, self.points.len()) - 1;
        let piece = self.lengths[k + 1] - self.lengths[k];
        let share = if piece > 0.0 { ((at - self.lengths[k]) / piece).clamp(0.0, 1.0) } else { 0.0 };
        let [p, q] = [self.points[k], self.points[(k + 1) % self.points.len()]];
        p + (q - p) * share
    }

    /// Which points are corners: where the curve turns most, and by enough.
    fn turns(&self) -> Vec<bool> {
        let reach = REACH.min(0.1 * self.length());
        let turns: Vec<f64> = self.lengths[..self.points.len()]
            .iter()
            .map(|&at| {
                let here = self.point(at);
                (here - self.point(at - reach)).angle(&(self.point(at + reach) - here)).to_degrees()
            })
            .collect();
        let mut corners = vec![false; turns.len()];
        let mut order: Vec<usize> = (0..turns.len()).filter(|&k| turns[k] > CORNER_DEG).collect();
        order.sort_by(|&a, &b| turns[b].total_cmp(&turns[a]).then(a.cmp(&b)));
        for k in order {
            let apart = |other: usize| {
                let way = (self.lengths[k] - self.lengths[other]).abs();
                way.min(self.length() - way)
            };
            corners[k] = !(0..turns.len()).any(|other| corners[other] && apart(other) < 2.0 * reach);
        }
        corners
    }
}
