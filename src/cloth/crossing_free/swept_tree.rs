//! A bounding volume hierarchy over faces in motion. Its boxes hold where a face is and how far it may move, so that faces
//! which move together are told from those which approach each other.

use crate::geometry::{Point, Vec3};

/// Where something is at the start of a step, and its displacement within the step: `f32`, rounded outward.
#[derive(Clone, Copy)]
#[repr(align(16))]
pub(in crate::cloth) struct Swept {
    low: [f32; 4],
    high: [f32; 4],
    /// Least and greatest displacement.
    from: [f32; 4],
    to: [f32; 4],
}

/// Rounding of a coordinate below 8 m to `f32`, in metres.
const ROUNDING: f32 = 1e-6;

impl Swept {
    const EMPTY: Self = Self { low: [f32::MAX; 4], high: [f32::MIN; 4], from: [f32::MAX; 4], to: [f32::MIN; 4] };

    /// A point that moves by `by`, or otherwise by up to `slack` metres.
    #[inline]
    pub fn point(at: &Point, by: &Vec3, slack: f64) -> Self {
        let mut swept = Self { low: [0.0; 4], high: [0.0; 4], from: [0.0; 4], to: [0.0; 4] };
        for k in 0..3 {
            swept.low[k] = at[k] as f32 - ROUNDING;
            swept.high[k] = at[k] as f32 + ROUNDING;
            swept.from[k] = (by[k] - slack) as f32 - ROUNDING;
            swept.to[k] = (by[k] + slack) as f32 + ROUNDING;
        }
        swept
    }

    /// Around both.
    #[inline]
    pub fn join(&self, other: &Self) -> Self {
        let least = |a: f32, b: f32| if b < a { b } else { a };
        let most = |a: f32, b: f32| if b > a { b } else { a };
        let mut both = *self;
        for k in 0..4 {
            both.low[k] = least(both.low[k], other.low[k]);
            both.high[k] = most(both.high[k], other.high[k]);
            both.from[k] = least(both.from[k], other.from[k]);
            both.to[k] = most(both.to[k], other.to[k]);
        }
        both
    }

    /// Whether the two may come within `reach` metres of each other on straight paths.
    #[inline]
    pub fn meets(&self, other: &Self, reach: f32) -> bool {
        let apart: [f32; 4] = std::array::from_fn(|k| {
            let closing = self.to[k] - other.from[k];
            let above = (other.low[k] - self.high[k]) - if closing > 0.0 { closing } else { 0.0 };
            let closing = other.to[k] - self.from[k];
            let below = (self.low[k] - other.high[k]) - if closing > 0.0 { closing } else { 0.0 };
            if above > below { above } else { below }
        });
        apart.iter().all(|&gap| gap <= reach)
    }
}

/// Faces to a leaf: two share most of their box.
const LEAF: usize = 2;

struct Node {
    first: u32,
    count: u32,
    /// The right child, 0 for a leaf; the left one is the next node.
    right: u32,
}

/// The hierarchy; its boxes are computed anew for each step.
pub(in crate::cloth) struct SweptTree {
    nodes: Vec<Node>,
    order: Vec<u32>,
}

/// A pair of nodes.
type Nodes = (u32, u32);

impl SweptTree {
    /// Divides the faces at the median of their centres, along the longest axis.
    pub fn prepare(centers: &[Point]) -> Self {
        let mut tree = Self { nodes: Vec::new(), order: (0..centers.len() as u32).collect() };
        let mut order = std::mem::take(&mut tree.order);
        if !order.is_empty() {
            tree.divide(&mut order, 0, centers);
        }
        tree.order = order;
        tree
    }

    fn divide(&mut self, order: &mut [u32], first: usize, centers: &[Point]) {
        let own = self.nodes.len();
        self.nodes.push(Node { first: first as u32, count: order.len() as u32, right: 0 });
        if order.len() <= LEAF {
            return;
        }
        let (mut low, mut high) = (Vec3::repeat(f64::MAX), Vec3::repeat(f64::MIN));
        for &face in order.iter() {
            let center = centers[face as usize].coords;
            (low, high) = (low.inf(&center), high.sup(&center));
        }
        let (axis, middle) = ((high - low).imax(), order.len() / 2);
        let along = |face: u32| centers[face as usize][axis];
        order.select_nth_unstable_by(middle, |&a, &b| along(a).total_cmp(&along(b)).then(a.cmp(&b)));
        let (left, right) = order.split_at_mut(middle);
        self.divide(left, first, centers);
        self.nodes[own].right = self.nodes.len() as u32;
        self.divide(right, first + middle, centers);
    }

    /// The box of each node.
    ///
    /// **Shapes** `faces`: one entry per face.
    pub fn boxes(&self, faces: &[Swept]) -> Vec<Swept> {
        let mut boxes = vec![Swept::EMPTY; self.nodes.len()];
        for k in (0..self.nodes.len()).rev() {
            boxes[k] = match self.nodes[k].right {
                0 => self.faces_of(k as u32).iter().fold(Swept::EMPTY, |all, &f| all.join(&faces[f as usize])),
                right => boxes[k + 1].join(&boxes[right as usize]),
            };
        }
        boxes
    }

    fn faces_of(&self, node: u32) -> &[u32] {
        let Node { first, count, .. } = self.nodes[node as usize];
        &self.order[first as usize..(first + count) as usize]
    }

    /// Pairs of nodes that together hold all pairs of faces which meet: enough of them to share among threads, always
    /// the same.
    pub fn tasks(&self, boxes: &[Swept], reach: f32) -> Vec<Nodes> {
        /// Enough that no thread waits for the longest of them.
        const TASKS: usize = 2000;
        let mut tasks = if self.nodes.is_empty() { Vec::new() } else { vec![(0, 0)] };
        let mut divided = true;
        while divided && tasks.len() < TASKS {
            divided = false;
            let mut finer = Vec::new();
            for &pair in &tasks {
                if !self.is_leaf_pair(pair) {
                    self.children(pair, boxes, reach, &mut finer);
                    divided = true;
                } else {
                    finer.push(pair);
                }
            }
            tasks = finer;
        }
        tasks
    }

    /// Calls `visit` with each pair of faces of a task that meet, once.
    pub fn visit(&self, task: Nodes, boxes: &[Swept], faces: &[Swept], reach: f32, mut visit: impl FnMut(u32, u32)) {
        let mut stack = vec![task];
        while let Some(pair) = stack.pop() {
            if !self.is_leaf_pair(pair) {
                self.children(pair, boxes, reach, &mut stack);
                continue;
            }
            for (k, &f) in self.faces_of(pair.0).iter().enumerate() {
                let others = self.faces_of(pair.1);
                let others = if pair.0 == pair.1 { &others[k + 1..] } else { others };
                for &g in others {
                    if faces[f as usize].meets(&faces[g as usize], reach) {
                        visit(f, g);
                    }
                }
            }
        }
    }

    /// Calls `visit` with each other face that meets `face`.
    pub fn visit_near(&self, face: u32, boxes: &[Swept], faces: &[Swept], reach: f32, mut visit: impl FnMut(u32)) {
        let own = &faces[face as usize];
        let mut stack = if self.nodes.is_empty() { Vec::new() } else { vec![0] };
        while let Some(node) = stack.pop() {
            if !boxes[node as usize].meets(own, reach) {
                continue;
            }
            match self.nodes[node as usize].right {
                0 => {
                    let others = self.faces_of(node).iter();
                    others.filter(|&&f| f != face && faces[f as usize].meets(own, reach)).for_each(|&f| visit(f));
                }
                right => stack.extend([node + 1, right]),
            }
        }
    }

    fn is_leaf(&self, node: u32) -> bool {
        self.nodes[node as usize].right == 0
    }

    fn is_leaf_pair(&self, (a, b): Nodes) -> bool {
        self.is_leaf(a) && self.is_leaf(b)
    }

    /// The pairs of children that meet; of a node with itself, each pair once.
    fn children(&self, (a, b): Nodes, boxes: &[Swept], reach: f32, out: &mut Vec<Nodes>) {
        let right = |node: u32| self.nodes[node as usize].right;
        let mut add = |a: u32, b: u32| {
            if a == b || boxes[a as usize].meets(&boxes[b as usize], reach) {
                out.push((a, b));
            }
        };
        if a == b {
            add(a + 1, a + 1);
            add(right(a), right(a));
            add(a + 1, right(a));
        } else if !self.is_leaf(a) && (self.is_leaf(b) || self.nodes[a as usize].count >= self.nodes[b as usize].count)
        {
            add(a + 1, b);
            add(right(a), b);
        } else {
            add(a, b + 1);
            add(a, right(b));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::Rng;
    use std::collections::BTreeSet;

    #[test]
    fn the_tree_finds_the_same_pairs_as_all_against_all() {
        let mut random = Rng::new(3);
        let mut uniform = || random.unit();
        let mut vector = |scale: f64| Vec3::new(uniform() - 0.5, uniform() - 0.5, uniform() - 0.5) * scale;
        let faces: Vec<([Point; 3], Vec3)> = (0..120)
            .map(|_| {
                let at = Point::from(vector(0.4));
                ([at, at + vector(0.1), at + vector(0.1)], vector(0.2))
            })
            .collect();
        let swept: Vec<Swept> = faces
            .iter()
            .map(|(corners, by)| corners.iter().fold(Swept::EMPTY, |all, p| all.join(&Swept::point(p, by, 1e-3))))
            .collect();
        let centers: Vec<Point> = faces.iter().map(|(corners, _)| corners[0]).collect();
        let tree = SweptTree::prepare(&centers);
        let (boxes, reach) = (tree.boxes(&swept), 2e-3);
        let mut found = Vec::new();
        for task in tree.tasks(&boxes, reach) {
            tree.visit(task, &boxes, &swept, reach, |f, g| found.push((f.min(g), f.max(g))));
        }
        let each_once: BTreeSet<_> = found.iter().copied().collect();
        assert_eq!(each_once.len(), found.len());
        let all = (0..120u32).flat_map(|f| (f + 1..120).map(move |g| (f, g)));
        let expected: BTreeSet<_> = all.filter(|&(f, g)| swept[f as usize].meets(&swept[g as usize], reach)).collect();
        assert_eq!(each_once, expected);
        assert!((100..5000).contains(&expected.len()), "{}", expected.len());
        let mut near = BTreeSet::new();
        tree.visit_near(7, &boxes, &swept, reach, |g| {
            near.insert((g.min(7), g.max(7)));
        });
        assert_eq!(near, expected.into_iter().filter(|&(f, g)| f == 7 || g == 7).collect());
    }

    #[test]
    fn what_moves_together_does_not_meet_and_what_approaches_does() {
        let (here, there) = (Point::origin(), Point::new(0.01, 0.0, 0.0));
        let far = Vec3::new(0.2, 0.0, 0.0);
        let meets = |a: Vec3, b: Vec3| Swept::point(&here, &a, 0.0).meets(&Swept::point(&there, &b, 0.0), 1e-3);
        assert!(!meets(far, far), "together");
        assert!(meets(far, Vec3::zeros()), "one runs into the other");
        assert!(!meets(-far, Vec3::zeros()), "they part");
    }
}
