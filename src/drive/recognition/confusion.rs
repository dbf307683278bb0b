//! How well poses are recognised.

/// Counts of recognised classes by true class.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Confusion {
    /// How often a pose of a class, the row, was recognised as one of another, the column.
    ///
    /// **Shapes** classes × classes.
    pub counts: Vec<Vec<usize>>,
}

impl Confusion {
    /// No poses yet.
    pub fn new(classes: usize) -> Self {
        Self { counts: vec![vec![0; classes]; classes] }
    }

    /// Counts a pose. Classes beyond those known so far enlarge the matrix.
    pub fn add(&mut self, truth: usize, recognized: usize) {
        let size = self.counts.len().max(truth + 1).max(recognized + 1);
        self.counts.resize(size, Vec::new());
        self.counts.iter_mut().for_each(|row| row.resize(size, 0));
        self.counts[truth][recognized] += 1;
    }

    /// How many poses were counted.
    pub fn total(&self) -> usize {
        self.counts.iter().flatten().sum()
    }

    /// The share of poses whose class was recognised; 0 without poses.
    pub fn accuracy(&self) -> f64 {
        let right: usize = self.counts.iter().enumerate().map(|(class, row)| row[class]).sum();
        share(right, self.total())
    }

    /// `(TP + TN) / (TP + TN + FP + FN)`, the mean over the classes.
    ///
    /// Misleading with many classes: most poses are true negatives of most classes, so of 30 classes even a guess
    /// reaches 0.93. It is here only to compare with the paper; use [`Confusion::accuracy`].
    ///
    /// **Source** Lifkooee 2019, §4.2.2.
    pub fn binary_accuracy(&self) -> f64 {
        let total = self.total();
        let of_class = |class: usize| {
            let right = self.counts[class][class];
            let truth: usize = self.counts[class].iter().sum();
            let recognized: usize = self.counts.iter().map(|row| row[class]).sum();
            let wrong = truth + recognized - 2 * right;
            share(total - wrong, total)
        };
        self.counts.iter().enumerate().map(|(class, _)| of_class(class)).sum::<f64>() / self.counts.len().max(1) as f64
    }

    /// The share of poses recognised, the mean over those classes that have poses: rare classes count as much as others.
    pub fn macro_recall(&self) -> f64 {
        let recalls: Vec<f64> = self
            .counts
            .iter()
            .enumerate()
            .map(|(class, row)| (row[class], row.iter().sum::<usize>()))
            .filter(|(_, truth)| *truth > 0)
            .map(|(right, truth)| share(right, truth))
            .collect();
        recalls.iter().sum::<f64>() / recalls.len().max(1) as f64
    }
}

fn share(part: usize, whole: usize) -> f64 {
    part as f64 / whole.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_three_figures_of_a_small_matrix() {
        let mut confusion = Confusion::new(2);
        for (truth, recognized, times) in [(0, 0, 3), (0, 1, 1), (1, 1, 2), (1, 2, 2), (2, 2, 2)] {
            (0..times).for_each(|_| confusion.add(truth, recognized));
        }
        assert_eq!(confusion.counts, [[3, 1, 0], [0, 2, 2], [0, 0, 2]]);
        assert_eq!(confusion.total(), 10);
        assert!((confusion.accuracy() - 0.7).abs() < 1e-12);
        assert!((confusion.binary_accuracy() - (0.9 + 0.7 + 0.8) / 3.0).abs() < 1e-12);
        assert!((confusion.macro_recall() - (0.75 + 0.5 + 1.0) / 3.0).abs() < 1e-12);
    }
    #[test]
    fn a_guess_among_thirty_classes_looks_accurate_only_in_the_paper_s_measure() {
        let mut confusion = Confusion::new(30);
        for truth in 0..30 {
            (0..30).for_each(|recognized| confusion.add(truth, recognized));
        }
        assert!(confusion.accuracy() < 0.04 && confusion.binary_accuracy() > 0.93);
        assert_eq!(Confusion::new(0).accuracy() + Confusion::new(0).binary_accuracy(), 0.0);
    }
}
