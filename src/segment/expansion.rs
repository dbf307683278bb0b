//! Labels of several kinds: alpha expansion over minimum cuts.

use super::max_flow::min_cut;

/// A label of a vertex: 0 is the rest of the scan, the others are garments.
pub(super) type Label = u8;

/// Sweeps over all labels. Each expansion lowers the cost, and outfits settle in two or three sweeps.
const SWEEPS: usize = 6;

/// The cost of labels on vertices, and of boundaries between different labels.
///
/// **Shapes** `of_label`: one list per label, each with one cost per node; `edges`: node, node, cost.
pub(super) struct LabelCosts<'a> {
    pub(super) of_label: &'a [Vec<i64>],
    pub(super) edges: &'a [(u32, u32, i64)],
}

impl LabelCosts<'_> {
    /// The cost of a labelling.
    pub(super) fn total(&self, labels: &[Label]) -> i64 {
        let alone: i64 = labels.iter().enumerate().map(|(i, &label)| self.of_label[usize::from(label)][i]).sum();
        let differs = |e: &&(u32, u32, i64)| labels[e.0 as usize] != labels[e.1 as usize];
        alone + self.edges.iter().filter(differs).map(|e| e.2).sum::<i64>()
    }

    /// Each node's cheapest label, whatever its neighbours.
    pub(super) fn cheapest(&self) -> Vec<Label> {
        let count = self.of_label.first().map_or(0, Vec::len);
        let cost = |label: usize, i: usize| self.of_label[label][i];
        (0..count)
            .map(|i| {
                (1..self.of_label.len()).fold(0, |best, l| if cost(l, i) < cost(best, i) { l } else { best }) as Label
            })
            .collect()
    }

    /// Lowers the cost of `labels` until no expansion of one label over the others lowers it further. Nodes that are `held` keep
    /// their labels. With two labels the result is a minimum; with more it costs at most twice the minimum's boundaries.
    ///
    /// **Shapes** `labels` and `held`: one entry per node.
    ///
    /// **Source** Boykov, Veksler & Zabih 2001, with the boundary costs of Potts; the graph without auxiliary nodes of
    /// Kolmogorov & Zabih 2004.
    pub(super) fn expand(&self, labels: &mut Vec<Label>, held: &dyn Fn(usize) -> bool) {
        let mut cost = self.total(labels);
        let mut unchanged = 0;
        for step in 0..SWEEPS * self.of_label.len() {
            let expanded = self.expanded(labels, (step % self.of_label.len()) as Label, held);
            let lower = self.total(&expanded);
            // Never an equal cost: the labels would depend on where the search began.
            if lower < cost {
                (*labels, cost, unchanged) = (expanded, lower, 0);
            } else {
                unchanged += 1;
            }
            if unchanged == self.of_label.len() {
                break;
            }
        }
    }

    /// The cheapest labels that differ from the given ones only where they become `alpha`.
    fn expanded(&self, labels: &[Label], alpha: Label, held: &dyn Fn(usize) -> bool) -> Vec<Label> {
        const FIXED: u32 = u32::MAX;
        let mut node = vec![FIXED; labels.len()];
        let mut free: Vec<usize> = Vec::new();
        for i in (0..labels.len()).filter(|&i| labels[i] != alpha && !held(i)) {
            node[i] = free.len() as u32;
            free.push(i);
        }
        // All costs are doubled, so that half a boundary is an integer.
        let of = |label: Label, i: usize| self.of_label[usize::from(label)][i];
        let mut unary: Vec<i64> = free.iter().map(|&i| 2 * (of(labels[i], i) - of(alpha, i))).collect();
        let mut edges: Vec<(u32, u32, i64)> = Vec::new();
        for &(i, j, cost) in self.edges {
            let (i, j) = (i as usize, j as usize);
            let differ = labels[i] != labels[j];
            // The other end keeps its label: a boundary now, and one if this end becomes alpha.
            let beside = |kept: usize| 2 * (i64::from(differ) - i64::from(labels[kept] != alpha)) * cost;
            match (node[i], node[j]) {
                (FIXED, FIXED) => {}
                (FIXED, at) => unary[at as usize] += beside(i),
                (at, FIXED) => unary[at as usize] += beside(j),
                (a, b) if differ => {
                    unary[a as usize] += cost;
                    unary[b as usize] += cost;
                    edges.push((a, b, cost));
                }
                (a, b) => edges.push((a, b, 2 * cost)),
            }
        }
        let mut expanded = labels.to_vec();
        for (i, takes) in free.into_iter().zip(min_cut(&unary, &edges)) {
            if takes {
                expanded[i] = alpha;
            }
        }
        expanded
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random(mut state: u64) -> impl FnMut(u64) -> i64 {
        move |below| {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            ((state >> 33) % below) as i64
        }
    }

    /// All labellings of `count` nodes with `labels` labels.
    fn all(count: usize, labels: usize) -> impl Iterator<Item = Vec<Label>> {
        (0..labels.pow(count as u32))
            .map(move |code| (0..count).map(|i| (code / labels.pow(i as u32) % labels) as Label).collect())
    }

    #[test]
    fn no_expansion_is_cheaper_and_the_cost_is_within_the_bound() {
        let mut next = random(99);
        for _ in 0..200 {
            let (count, labels) = (2 + next(5) as usize, 2 + next(3) as usize);
            let of_label: Vec<Vec<i64>> = (0..labels).map(|_| (0..count).map(|_| next(30)).collect()).collect();
            let edges: Vec<(u32, u32, i64)> = (0..next(12))
                .map(|_| (next(count as u64) as u32, next(count as u64) as u32, next(15)))
                .filter(|e| e.0 != e.1)
                .collect();
            let costs = LabelCosts { of_label: &of_label, edges: &edges };
            let mut found = costs.cheapest();
            costs.expand(&mut found, &|_| false);
            let least = all(count, labels).map(|l| costs.total(&l)).min().unwrap();
            for alpha in 0..labels as Label {
                let moves = all(count, labels).filter(|l| l.iter().zip(&found).all(|(&a, &b)| a == b || a == alpha));
                assert!(moves.map(|l| costs.total(&l)).min().unwrap() >= costs.total(&found), "{of_label:?} {edges:?}");
            }
            assert!(costs.total(&found) <= 2 * least, "{of_label:?} {edges:?}");
            assert!(labels > 2 || costs.total(&found) == least, "two labels have a minimum: {of_label:?} {edges:?}");
        }
    }

    #[test]
    fn held_nodes_keep_their_labels_and_others_follow_them() {
        // A chain of ten, of which the ends are held; every label costs the same, a boundary costs 5.
        let of_label = vec![vec![0; 10]; 3];
        let edges: Vec<(u32, u32, i64)> = (0..9).map(|i| (i, i + 1, if i == 3 { 1 } else { 5 })).collect();
        let costs = LabelCosts { of_label: &of_label, edges: &edges };
        let mut labels = vec![1, 0, 0, 0, 0, 0, 0, 0, 0, 2];
        costs.expand(&mut labels, &|i| i == 0 || i == 9);
        assert_eq!(labels, [1, 1, 1, 1, 2, 2, 2, 2, 2, 2]);
    }
}
