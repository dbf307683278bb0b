//! Minimum cut of a graph with two terminals.

use std::collections::VecDeque;

/// No parent: the node is free.
const FREE: u32 = u32::MAX;
/// The parent is the terminal itself.
const TERMINAL: u32 = u32::MAX - 1;
/// The parent was lost; a new one is being searched for.
const ORPHAN: u32 = u32::MAX - 2;

/// Per node whether it is on the source's side of a minimum cut.
///
/// **Shapes** `unary` and the result: one entry per node; `edges`: node, node, cost.
///
/// `unary[i]` is what it costs to leave node `i` to the sink (positive) or to the source (negative); `(i, j, c)` costs
/// `c ≥ 0` if `i` and `j` are on different sides. Integers, so that the result is exact and deterministic.
///
/// **Source** Boykov & Kolmogorov 2004: two search trees that are kept from one augmentation to the next, with their
/// time stamps and distances.
pub fn min_cut(unary: &[i64], edges: &[(u32, u32, i64)]) -> Vec<bool> {
    let mut graph = Graph::new(unary, edges);
    graph.solve();
    (0..unary.len()).map(|i| graph.parent[i] != FREE && !graph.in_sink[i]).collect()
}

struct Graph {
    start: Vec<u32>,
    head: Vec<u32>,
    reverse: Vec<u32>,
    capacity: Vec<i64>,
    /// Left to the terminals: positive from the source, negative to the sink.
    terminal: Vec<i64>,
    /// The arc from a node to its parent.
    parent: Vec<u32>,
    in_sink: Vec<bool>,
    stamp: Vec<u32>,
    distance: Vec<u32>,
    time: u32,
    active: VecDeque<u32>,
    orphans: VecDeque<u32>,
}

impl Graph {
    fn new(unary: &[i64], edges: &[(u32, u32, i64)]) -> Self {
        let count = unary.len();
        let mut start = vec![0u32; count + 1];
        for &(i, j, _) in edges {
            start[i as usize + 1] += 1;
            start[j as usize + 1] += 1;
        }
        for i in 0..count {
            start[i + 1] += start[i];
        }
        let mut cursor = start.clone();
        let mut place = |node: u32| {
            let at = cursor[node as usize];
            cursor[node as usize] += 1;
            at
        };
        let arcs = 2 * edges.len();
        let (mut head, mut reverse, mut capacity) = (vec![0; arcs], vec![0; arcs], vec![0; arcs]);
        for &(i, j, c) in edges {
            let (there, back) = (place(i), place(j));
            (head[there as usize], reverse[there as usize], capacity[there as usize]) = (j, back, c.max(0));
            (head[back as usize], reverse[back as usize], capacity[back as usize]) = (i, there, c.max(0));
        }
        let mut graph = Self {
            start,
            head,
            reverse,
            capacity,
            terminal: unary.to_vec(),
            parent: vec![FREE; count],
            in_sink: vec![false; count],
            stamp: vec![0; count],
            distance: vec![1; count],
            time: 0,
            active: VecDeque::new(),
            orphans: VecDeque::new(),
        };
        for (i, &u) in unary.iter().enumerate().filter(|&(_, &u)| u != 0) {
            graph.in_sink[i] = u < 0;
            graph.parent[i] = TERMINAL;
            graph.active.push_back(i as u32);
        }
        graph
    }

    fn arcs(&self, node: u32) -> std::ops::Range<u32> {
        self.start[node as usize]..self.start[node as usize + 1]
    }

    /// The residual capacity of `arc` of `node` in the direction of the node's tree: away from the source, or from the
    /// neighbour toward the sink.
    fn outward(&self, arc: u32, sink: bool) -> i64 {
        self.capacity[if sink { self.reverse[arc as usize] } else { arc } as usize]
    }

    fn solve(&mut self) {
        while let Some(&node) = self.active.front() {
            if self.parent[node as usize] == FREE {
                self.active.pop_front();
                continue;
            }
            match self.grow(node) {
                Some(bridge) => {
                    self.time += 1;
                    self.augment(bridge);
                    while let Some(orphan) = self.orphans.pop_front() {
                        self.adopt(orphan);
                    }
                }
                None => {
                    self.active.pop_front();
                }
            }
        }
    }

    /// Extends the tree of `node`; an arc from the source's tree to the sink's, if one is met.
    fn grow(&mut self, node: u32) -> Option<u32> {
        let (i, sink) = (node as usize, self.in_sink[node as usize]);
        for arc in self.arcs(node) {
            if self.outward(arc, sink) == 0 {
                continue;
            }
            let j = self.head[arc as usize] as usize;
            if self.parent[j] == FREE {
                self.in_sink[j] = sink;
                self.parent[j] = self.reverse[arc as usize];
                self.stamp[j] = self.stamp[i];
                self.distance[j] = self.distance[i] + 1;
                self.active.push_back(j as u32);
            } else if self.in_sink[j] != sink {
                return Some(if sink { self.reverse[arc as usize] } else { arc });
            } else if self.stamp[j] <= self.stamp[i] && self.distance[j] > self.distance[i] {
                self.parent[j] = self.reverse[arc as usize];
                self.stamp[j] = self.stamp[i];
                self.distance[j] = self.distance[i] + 1;
            }
        }
        None
    }

    /// Augments along the path through `bridge`.
    fn augment(&mut self, bridge: u32) {
        let ends = [self.head[self.reverse[bridge as usize] as usize], self.head[bridge as usize]];
        let mut fits = self.capacity[bridge as usize];
        for (mut i, sink) in ends.into_iter().zip([false, true]) {
            while self.parent[i as usize] != TERMINAL {
                let up = self.parent[i as usize];
                fits = fits.min(self.outward(up, !sink));
                i = self.head[up as usize];
            }
            fits = fits.min(self.terminal[i as usize].abs());
        }
        self.push(bridge, fits);
        for (mut i, sink) in ends.into_iter().zip([false, true]) {
            while self.parent[i as usize] != TERMINAL {
                let up = self.parent[i as usize];
                self.push(if sink { up } else { self.reverse[up as usize] }, fits);
                if self.outward(up, !sink) == 0 {
                    self.orphan(i);
                }
                i = self.head[up as usize];
            }
            self.terminal[i as usize] += if sink { fits } else { -fits };
            if self.terminal[i as usize] == 0 {
                self.orphan(i);
            }
        }
    }

    fn push(&mut self, arc: u32, flow: i64) {
        self.capacity[arc as usize] -= flow;
        self.capacity[self.reverse[arc as usize] as usize] += flow;
    }

    fn orphan(&mut self, node: u32) {
        self.parent[node as usize] = ORPHAN;
        self.orphans.push_back(node);
    }

    /// Finds a new parent for `node` that is still connected to its terminal, or frees the node.
    fn adopt(&mut self, node: u32) {
        let sink = self.in_sink[node as usize];
        let mut best = (u32::MAX, FREE);
        for arc in self.arcs(node) {
            let j = self.head[arc as usize];
            // Flow comes from the parent in the source's tree and goes to it in the sink's.
            if self.outward(arc, !sink) == 0 || self.in_sink[j as usize] != sink || self.parent[j as usize] == FREE {
                continue;
            }
            if let Some(distance) = self.distance_to_terminal(j)
                && distance < best.0
            {
                best = (distance, arc);
            }
        }
        self.parent[node as usize] = best.1;
        if best.1 != FREE {
            self.stamp[node as usize] = self.time;
            self.distance[node as usize] = best.0 + 1;
            return;
        }
        for arc in self.arcs(node) {
            let j = self.head[arc as usize];
            let up = self.parent[j as usize];
            if self.in_sink[j as usize] != sink || up == FREE {
                continue;
            }
            if self.outward(arc, !sink) > 0 {
                self.active.push_back(j);
            }
            if up < ORPHAN && self.head[up as usize] == node {
                self.orphan(j);
            }
        }
    }

    /// The distance to the terminal if the path to it is complete; stamps the path.
    fn distance_to_terminal(&mut self, from: u32) -> Option<u32> {
        let (mut i, mut steps) = (from as usize, 0);
        loop {
            if self.stamp[i] == self.time && self.parent[i] != ORPHAN {
                steps += self.distance[i];
                break;
            }
            match self.parent[i] {
                TERMINAL => {
                    self.stamp[i] = self.time;
                    self.distance[i] = 1;
                    steps += 1;
                    break;
                }
                ORPHAN | FREE => return None,
                up => i = self.head[up as usize] as usize,
            }
            steps += 1;
        }
        let (mut i, mut left) = (from as usize, steps);
        while self.stamp[i] != self.time {
            self.stamp[i] = self.time;
            self.distance[i] = left;
            left -= 1;
            i = self.head[self.parent[i] as usize] as usize;
        }
        Some(steps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(unary: &[i64], edges: &[(u32, u32, i64)], side: &[bool]) -> i64 {
        let alone: i64 = unary.iter().zip(side).map(|(&u, &source)| if source { (-u).max(0) } else { u.max(0) }).sum();
        alone + edges.iter().filter(|e| side[e.0 as usize] != side[e.1 as usize]).map(|e| e.2).sum::<i64>()
    }

    #[test]
    fn no_other_labelling_is_cheaper() {
        let mut state = 12345u64;
        let mut next = move |below: u64| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 33) % below
        };
        for _ in 0..300 {
            let count = 2 + next(9) as usize;
            let unary: Vec<i64> = (0..count).map(|_| next(21) as i64 - 10).collect();
            let edges: Vec<(u32, u32, i64)> = (0..next(20))
                .map(|_| (next(count as u64) as u32, next(count as u64) as u32, next(8) as i64))
                .filter(|e| e.0 != e.1)
                .collect();
            let found = cost(&unary, &edges, &min_cut(&unary, &edges));
            let least = (0..1u32 << count)
                .map(|bits| cost(&unary, &edges, &(0..count).map(|i| bits >> i & 1 == 1).collect::<Vec<_>>()))
                .min()
                .unwrap();
            assert_eq!(found, least, "{unary:?} {edges:?}");
        }
    }

    #[test]
    fn a_noisy_picture_becomes_two_fields_quickly() {
        let side = 200u32;
        let mut state = 7u64;
        let mut noise = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as i64 % 1000 - 500
        };
        let unary: Vec<i64> =
            (0..side * side).map(|i| if i % side < side / 2 { 200 } else { -200 } + noise()).collect();
        let mut edges = Vec::new();
        for y in 0..side {
            for x in 0..side {
                let i = y * side + x;
                if x + 1 < side {
                    edges.push((i, i + 1, 400));
                }
                if y + 1 < side {
                    edges.push((i, i + side, 400));
                }
            }
        }
        let found = min_cut(&unary, &edges);
        let wrong = (0..side * side).filter(|&i| found[i as usize] != (i % side < side / 2)).count();
        assert!(wrong < (side * side / 100) as usize, "{wrong}");
    }
}
