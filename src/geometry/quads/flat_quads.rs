//! Removes quads that no move of their corners makes good: two opposite corners become one.

use super::subdivision::Quads;
use nalgebra::center;

/// More quads than this do not meet in a vertex afterwards.
const MOST_AROUND: usize = 8;

/// The mesh without some of the `flat` quads, as far as it stays manifold; `None` if no quad can go.
///
/// **Shapes** `flat`: ids of quads, the worst first; `may_join` is asked about pairs of vertices.
///
/// **Source** Daniels et al. 2008, Quadrilateral mesh simplification: the diagonal collapse.
pub(super) fn without_flat_quads(quads: &Quads, flat: &[u32], may_join: &dyn Fn(u32, u32) -> bool) -> Option<Quads> {
    let mut work = Work::of(quads);
    let count = flat.iter().filter(|&&q| work.collapse(q, 0, may_join) || work.collapse(q, 1, may_join)).count();
    (count > 0).then(|| work.rest())
}

struct Work {
    all: Quads,
    is_left: Vec<bool>,
    quads_of: Vec<Vec<u32>>,
    /// Corners of changed quads stay for now: where they go is not known yet.
    is_changed: Vec<bool>,
}

impl Work {
    fn of(quads: &Quads) -> Self {
        let mut quads_of = vec![Vec::new(); quads.points.len()];
        for (q, quad) in (0u32..).zip(&quads.quads) {
            quad.iter().for_each(|&v| quads_of[v as usize].push(q));
        }
        let is_changed = vec![false; quads.points.len()];
        Self { all: quads.clone(), is_left: vec![true; quads.quads.len()], quads_of, is_changed }
    }

    /// Joins the ends of the shorter diagonal, or with `other` 1 those of the longer.
    fn collapse(&mut self, q: u32, other: usize, may_join: &dyn Fn(u32, u32) -> bool) -> bool {
        let quad = self.all.quads[q as usize];
        if !self.is_left[q as usize] || quad.iter().any(|&v| self.is_changed[v as usize]) {
            return false;
        }
        let length =
            |k: usize| (self.all.points[quad[k] as usize] - self.all.points[quad[k + 2] as usize]).norm_squared();
        let first = usize::from(length(1) < length(0));
        let [a, b, c, d] = std::array::from_fn(|k| quad[(first + other + k) % 4]);
        // Those on borders stay.
        let (a, c) = if self.is_border(c) { (c, a) } else { (a, c) };
        if self.is_border(c)
            || !may_join(a, c)
            || ![b, d].iter().all(|&v| self.can_lose_a_quad(v))
            || !self.are_joined_by(a, c, [b, d])
        {
            return false;
        }
        let around = self.quads_of[a as usize].len() + self.quads_of[c as usize].len() - 2;
        if !(3..=MOST_AROUND).contains(&around) {
            return false;
        }
        if !self.is_border(a) {
            self.all.points[a as usize] = center(&self.all.points[a as usize], &self.all.points[c as usize]);
        }
        self.is_left[q as usize] = false;
        quad.iter().for_each(|&v| self.quads_of[v as usize].retain(|&other| other != q));
        for r in std::mem::take(&mut self.quads_of[c as usize]) {
            self.all.quads[r as usize] = self.all.quads[r as usize].map(|v| if v == c { a } else { v });
            self.quads_of[a as usize].push(r);
        }
        for &r in &self.quads_of[a as usize] {
            self.all.quads[r as usize].iter().for_each(|&v| self.is_changed[v as usize] = true);
        }
        true
    }

    fn is_border(&self, v: u32) -> bool {
        self.all.on_border[v as usize].is_some()
    }

    fn can_lose_a_quad(&self, v: u32) -> bool {
        let least = match self.all.on_border[v as usize] {
            None => 3,
            Some(place) if place.is_corner => 1,
            Some(_) => 2,
        };
        self.quads_of[v as usize].len() > least
    }

    /// Whether two vertices share one quad and no neighbours but `between`.
    fn are_joined_by(&self, a: u32, c: u32, between: [u32; 2]) -> bool {
        let common = self.quads_of[a as usize].iter().filter(|q| self.quads_of[c as usize].contains(q)).count();
        let of_c = self.neighbours(c);
        let of_a = self.neighbours(a);
        common == 1 && !of_a.contains(&c) && of_a.iter().all(|v| between.contains(v) || !of_c.contains(v))
    }

    fn neighbours(&self, v: u32) -> Vec<u32> {
        let beside = |&q: &u32| {
            let quad = self.all.quads[q as usize];
            let k = quad.iter().position(|&w| w == v).unwrap_or(0);
            [quad[(k + 1) % 4], quad[(k + 3) % 4]]
        };
        self.quads_of[v as usize].iter().flat_map(beside).collect()
    }

    /// What is left, with the vertices that it uses.
    fn rest(self) -> Quads {
        let mut rest = Quads { points: Vec::new(), quads: Vec::new(), on_border: Vec::new(), on_face: Vec::new() };
        let mut new_of = vec![u32::MAX; self.all.points.len()];
        for v in (0..new_of.len()).filter(|&v| !self.quads_of[v].is_empty()) {
            new_of[v] = rest.add(self.all.points[v], self.all.on_border[v], self.all.on_face[v]);
        }
        let left = self.all.quads.iter().zip(&self.is_left).filter(|(_, left)| **left);
        rest.quads = left.map(|(quad, _)| quad.map(|v| new_of[v as usize])).collect();
        rest
    }
}
