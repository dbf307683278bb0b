//! A triangulated patch over a closed ring of points.

use crate::geometry::{Point, least_area_faces};
use std::collections::BTreeMap;

/// Greatest number of points of a filled ring: the time grows with its cube (250: some 10 ms).
pub(in crate::cut) const GREATEST_RING: usize = 250;
/// Rounds of splitting and flipping; each shortens edges by at most √3, so six cover a factor of 20.
const ROUNDS: usize = 6;

/// Faces over ring points (the first `ring` ids) and new points (the ids after them).
pub(in crate::cut) struct Patch {
    pub(in crate::cut) points: Vec<Point>,
    pub(in crate::cut) faces: Vec<[usize; 3]>,
}

impl Patch {
    /// Triangulates a ring, with triangles about as large as its edges. The ring has the direction of the faces beside it, so
    /// the patch has the opposite one. `taken(i, j)` tells whether ring points `i` and `j` already share an edge.
    ///
    /// `None` if the ring has more than `greatest` points, or cannot be triangulated without such an edge.
    ///
    /// **Source** Liepa 2003, with least area as the only criterion.
    pub(in crate::cut) fn over(ring: &[Point], greatest: usize, taken: impl Fn(usize, usize) -> bool) -> Option<Self> {
        if !(3..=greatest).contains(&ring.len()) {
            return None;
        }
        let faces = least_area_faces(ring, &taken)?;
        let mut patch = Self { points: ring.to_vec(), faces };
        let count = ring.len();
        let length = |i: usize| (ring[(i + 1) % count] - ring[i]).norm();
        let mut sizes: Vec<f64> = (0..count).map(|i| 0.5 * (length((i + count - 1) % count) + length(i))).collect();
        for _ in 0..ROUNDS {
            let split = patch.split_large(&mut sizes);
            patch.flip_to_delaunay(&taken, count);
            if !split {
                break;
            }
        }
        Some(patch)
    }

    /// Adds a point in each face that is too large for the edge lengths at its corners. Returns whether there was one.
    fn split_large(&mut self, sizes: &mut Vec<f64>) -> bool {
        let before = self.faces.len();
        for f in 0..before {
            let [a, b, c] = self.faces[f];
            let center = Point::from((self.points[a].coords + self.points[b].coords + self.points[c].coords) / 3.0);
            let size = (sizes[a] + sizes[b] + sizes[c]) / 3.0;
            let far = |v: usize| {
                let gap = std::f64::consts::SQRT_2 * (center - self.points[v]).norm();
                gap > size && gap > sizes[v]
            };
            if [a, b, c].into_iter().all(far) {
                let new = self.points.len();
                self.points.push(center);
                sizes.push(size);
                self.faces[f] = [a, b, new];
                self.faces.extend([[b, c, new], [c, a, new]]);
            }
        }
        self.faces.len() > before
    }

    fn flip_to_delaunay(&mut self, taken: &impl Fn(usize, usize) -> bool, ring: usize) {
        /// Flips converge within a few passes; more would alternate between equal choices.
        const PASSES: usize = 10;
        for _ in 0..PASSES {
            let mut at_edge: BTreeMap<(usize, usize), Vec<(usize, usize)>> = BTreeMap::new();
            for (f, face) in self.faces.iter().enumerate() {
                for k in 0..3 {
                    let (a, b) = (face[k], face[(k + 1) % 3]);
                    at_edge.entry((a.min(b), a.max(b))).or_default().push((f, face[(k + 2) % 3]));
                }
            }
            let mut touched = vec![false; self.faces.len()];
            let mut made: Vec<(usize, usize)> = Vec::new();
            for (&(a, b), sides) in &at_edge {
                let &[(f, p), (g, q)] = sides.as_slice() else { continue };
                let joined = (p.min(q), p.max(q));
                let barred = p == q
                    || at_edge.contains_key(&joined)
                    || made.contains(&joined)
                    || (p < ring && q < ring && taken(p, q));
                if touched[f] || touched[g] || barred || self.angle(p, a, b) + self.angle(q, a, b) <= FLAT_ENOUGH {
                    continue;
                }
                // Face f has the edge as a → b or b → a; keep its orientation.
                let runs = (0..3).any(|k| self.faces[f][k] == a && self.faces[f][(k + 1) % 3] == b);
                let (from, to) = if runs { (a, b) } else { (b, a) };
                self.faces[f] = [p, from, q];
                self.faces[g] = [q, to, p];
                (touched[f], touched[g]) = (true, true);
                made.push(joined);
            }
            if made.is_empty() {
                break;
            }
        }
    }

    /// The angle at `p` in the triangle with `a` and `b`.
    fn angle(&self, p: usize, a: usize, b: usize) -> f64 {
        (self.points[a] - self.points[p]).angle(&(self.points[b] - self.points[p]))
    }
}

/// Sum of opposite angles above which an edge is flipped, in radians: π, and a margin against flipping back and forth.
const FLAT_ENOUGH: f64 = std::f64::consts::PI + 1e-9;

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(count: usize) -> Vec<Point> {
        (0..count)
            .map(|i| {
                let a = std::f64::consts::TAU * i as f64 / count as f64;
                Point::new(a.cos(), a.sin(), 0.0)
            })
            .collect()
    }

    #[test]
    fn a_flat_ring_is_spanned_once_and_against_its_sense() {
        let ring = circle(40);
        let patch = Patch::over(&ring, GREATEST_RING, |_, _| false).unwrap();
        assert!(patch.points.len() > 60, "{} points", patch.points.len());
        let areas: Vec<f64> = patch
            .faces
            .iter()
            .map(|&[a, b, c]| 0.5 * (patch.points[b] - patch.points[a]).cross(&(patch.points[c] - patch.points[a])).z)
            .collect();
        assert!(areas.iter().all(|&a| a < 0.0), "a ring seen counter-clockwise is filled clockwise");
        let polygon = 0.5 * 40.0 * (std::f64::consts::TAU / 40.0).sin();
        assert!((areas.iter().sum::<f64>() + polygon).abs() < 1e-9);
        // Euler: a disk.
        let mut edges: Vec<(usize, usize)> = patch
            .faces
            .iter()
            .flat_map(|f| (0..3).map(|k| (f[k].min(f[(k + 1) % 3]), f[k].max(f[(k + 1) % 3]))))
            .collect();
        edges.sort_unstable();
        edges.dedup();
        assert_eq!(patch.points.len() as i64 - edges.len() as i64 + patch.faces.len() as i64, 1);
    }

    #[test]
    fn joins_that_are_taken_are_not_made_again() {
        let ring = circle(6);
        let patch = Patch::over(&ring, GREATEST_RING, |i, j| (i.min(j), i.max(j)) == (0, 2)).unwrap();
        assert!(!patch.faces.iter().any(|f| f.contains(&0) && f.contains(&2)));
        assert!(Patch::over(&circle(4), GREATEST_RING, |_, _| true).is_none());
        assert!(Patch::over(&circle(20), 19, |_, _| false).is_none());
    }
}
