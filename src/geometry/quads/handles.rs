//! Closes handles too small for the quads: tunnels as thin as a thread, where crumpled cloth touched itself in the scan.

use super::contraction::Contraction;
use std::collections::{HashMap, HashSet};

/// Rings of three edges up to this length are cut, as a share of the spacing: a third of it is a quad's diagonal.
const LONGEST_RING: f64 = 2.5;

impl Contraction<'_> {
    /// Cuts the surface along rings of three edges without a face, and closes both sides with one; whether there were any.
    /// A ring that separates a part, as around a finger, stays.
    pub fn close_small_handles(&mut self) -> bool {
        let mut has_closed = false;
        for [a, b] in self.edges() {
            if self.is_border(a) || self.is_border(b) || self.faces_of_edge(a, b).len() != 2 {
                continue;
            }
            let around_b = self.neighbours(b);
            let is_third = |c: &u32| {
                around_b.binary_search(c).is_ok()
                    && !self.is_border(*c)
                    && !self.faces_of_edge(a, b).iter().any(|&f| self.corners(f).contains(c))
                    && self.length(a, b) + self.length(b, *c) + self.length(*c, a) < LONGEST_RING * self.spacing(a, b)
            };
            let third = self.neighbours(a).into_iter().find(is_third);
            if let Some(c) = third {
                has_closed |= self.cut([a, b, c]);
            }
        }
        has_closed
    }

    fn cut(&mut self, ring: [u32; 3]) -> bool {
        let face_of_side: HashMap<[u32; 2], u32> = ring
            .iter()
            .flat_map(|&v| self.faces_of[v as usize].iter().copied())
            .flat_map(|f| {
                let [a, b, c] = self.corners(f);
                [([a, b], f), ([b, c], f), ([c, a], f)]
            })
            .collect();
        let sides: HashSet<[u32; 2]> = (0..3).map(|k| [ring[k], ring[(k + 1) % 3]]).collect();
        // On the right of the ring its vertices are doubled.
        let mut right: Vec<(u32, u32)> = Vec::new();
        for &v in &ring {
            let Some(faces) = self.faces_right_of(v, &sides, &face_of_side) else { return false };
            right.extend(faces.into_iter().map(|f| (f, v)));
        }
        if self.separates(&sides) {
            return false;
        }
        let doubles = ring.map(|v| self.double(v));
        for (f, v) in right {
            let double = doubles[ring.iter().position(|&w| w == v).unwrap_or(0)];
            self.faces[f as usize] =
                self.faces[f as usize].map(|corners| corners.map(|w| if w == v { double } else { w }));
            self.faces_of[v as usize].retain(|&g| g != f);
            self.faces_of[double as usize].push(f);
        }
        let [a, b, c] = ring;
        for cap in [[b, a, c], doubles] {
            let f = self.faces.len() as u32;
            self.faces.push(Some(cap));
            cap.iter().for_each(|&v| self.faces_of[v as usize].push(f));
        }
        true
    }

    /// The faces around a vertex of the ring between its two sides, on the right.
    fn faces_right_of(
        &self,
        v: u32,
        sides: &HashSet<[u32; 2]>,
        face_of_side: &HashMap<[u32; 2], u32>,
    ) -> Option<Vec<u32>> {
        let next = sides.iter().find(|side| side[0] == v)?[1];
        let before = sides.iter().find(|side| side[1] == v)?[0];
        // From the face that walks from the next vertex to this one, around it to the one that walks on to the vertex before.
        let (mut from, mut faces) = (next, Vec::new());
        for _ in 0..self.faces_of[v as usize].len() {
            let &f = face_of_side.get(&[from, v])?;
            faces.push(f);
            from = self.third(f, from, v);
            if from == before {
                return Some(faces);
            }
        }
        None
    }

    /// Whether no way leads around the ring from its one side to the other.
    fn separates(&self, sides: &HashSet<[u32; 2]>) -> bool {
        let Some(&[a, b]) = sides.iter().min() else { return true };
        let [Some(left), Some(right)] = [[a, b], [b, a]].map(|side| self.face_with(side)) else { return true };
        let (mut seen, mut open) = (HashSet::from([left]), vec![left]);
        while let Some(f) = open.pop() {
            let [a, b, c] = self.corners(f);
            for [a, b] in [[a, b], [b, c], [c, a]] {
                if sides.contains(&[a, b]) || sides.contains(&[b, a]) {
                    continue;
                }
                if let Some(g) = self.face_with([b, a]).filter(|&g| seen.insert(g)) {
                    if g == right {
                        return false;
                    }
                    open.push(g);
                }
            }
        }
        true
    }

    /// The face that walks from one vertex to another.
    fn face_with(&self, [a, b]: [u32; 2]) -> Option<u32> {
        let walks = |&f: &u32| {
            let corners = self.corners(f);
            (0..3).any(|k| corners[k] == a && corners[(k + 1) % 3] == b)
        };
        self.faces_of[a as usize].iter().copied().find(walks)
    }
}
