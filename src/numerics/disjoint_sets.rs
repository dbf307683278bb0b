//! Disjoint sets of indices.

/// Sets of indices that are joined pair by pair.
pub struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    /// Each of `count` indices alone.
    pub fn of_single(count: usize) -> Self {
        Self { parent: (0..count as u32).collect() }
    }

    /// The index that stands for the set of `index`.
    pub fn root(&mut self, index: usize) -> usize {
        let mut at = index as u32;
        while self.parent[at as usize] != at {
            self.parent[at as usize] = self.parent[self.parent[at as usize] as usize];
            at = self.parent[at as usize];
        }
        at as usize
    }

    /// Joins the sets of two indices, that of `a` stands for both; returns whether they were not one before.
    pub fn join(&mut self, a: usize, b: usize) -> bool {
        let [a, b] = [a, b].map(|index| self.root(index));
        self.parent[b] = a as u32;
        a != b
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_joined_has_one_root_and_all_else_its_own() {
        let mut sets = DisjointSets::of_single(6);
        assert!(sets.join(0, 1) && sets.join(2, 3) && sets.join(1, 3) && !sets.join(0, 2));
        let roots: Vec<usize> = (0..6).map(|k| sets.root(k)).collect();
        assert_eq!(roots, [0, 0, 0, 0, 4, 5]);
    }
}
