//! Selects the angles that tell classes of poses apart best, by decision trees.
//!
//! **Source** Lifkooee 2019, §3.2: the tree learns from the samples and from their mirror images, so that no side is
//! preferred. A mirror image may be of another class: that of a raised left arm is a raised right arm. We keep an angle
//! together with its mirror image, so that the descriptor is symmetric. A single tree uses a few dozen angles, fewer than
//! the paper's 60; the next tree then grows without the angles selected so far.

use super::descriptor::{Angle, complete_descriptor};
use super::error::RecognitionError;
use crate::drive::landmark::Places;
use smartcore::linalg::basic::matrix::DenseMatrix;
use smartcore::tree::decision_tree_classifier::{DecisionTreeClassifier, DecisionTreeClassifierParameters};

/// Most samples that trees learn from, besides their mirror images; of more, every n-th is used. A split takes time in
/// proportion to it, and 25 samples of each of 30 classes suffice.
const SAMPLES_MOST: usize = 750;
/// Fewest rows in a leaf: splits of fewer separate single samples, not classes.
const LEAF_LEAST: usize = 5;
/// Greatest depth of a tree: 30 classes need five levels, and angles tell classes apart imperfectly.
const DEPTH_MOST: u16 = 8;

/// An angle of the descriptor, and why it was selected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SalientAngle {
    /// The angle.
    pub angle: Angle,
    /// The decrease of the Gini impurity by splits on this angle and its mirror image, as a share of that by the whole tree.
    pub importance: f64,
    /// The tree that uses it; 0 is the first.
    pub tree: usize,
    /// Its variance over samples and mirror images, in square radians, as in the paper's Table 1.
    pub variance: f64,
}

/// Selects about `size` angles, the most important first: in order of the trees, and for each tree by importance.
///
/// **Shapes** `classes` and `mirrored_classes`, those of the mirror images: one label per sample.
///
/// **Guarantees** the result is symmetric and deterministic. There is one angle fewer than requested if the last place would
/// divide an angle from its mirror image, and fewer if nothing else tells the classes apart.
///
/// **Errors** other numbers of labels, fewer than two classes, no complete sample. Incomplete samples are left out.
pub fn select_angles(
    samples: &[Places],
    classes: &[usize],
    mirrored_classes: &[usize],
    size: usize,
) -> Result<Vec<SalientAngle>, RecognitionError> {
    if let Some(other) = [classes, mirrored_classes].into_iter().find(|labels| labels.len() != samples.len()) {
        return Err(RecognitionError::LabelCount { samples: samples.len(), labels: other.len() });
    }
    let candidates = Candidates::new(samples, classes, mirrored_classes)?;
    let mut selected: Vec<SalientAngle> = Vec::new();
    for tree in 0.. {
        let left: Vec<usize> =
            candidates.pairs().filter(|k| !selected.iter().any(|s| s.angle == candidates.angles[*k])).collect();
        let ranked = candidates.ranked(&left)?;
        let before = selected.len();
        for (k, importance) in ranked {
            let mut pair = vec![k, candidates.mirrored[k]];
            pair.dedup();
            if selected.len() + pair.len() <= size {
                let variance = candidates.variance(k);
                let salient = |k: &usize| SalientAngle { angle: candidates.angles[*k], importance, tree, variance };
                selected.extend(pair.iter().map(salient));
            }
        }
        if selected.len() == before || selected.len() >= size {
            break;
        }
    }
    Ok(selected)
}

/// All angles of samples and mirror images.
struct Candidates {
    angles: Vec<Angle>,
    /// Where the mirror image of each angle is.
    mirrored: Vec<usize>,
    /// Each angle over all rows: samples, then their mirror images. Trees compare angles only, so half the precision suffices.
    columns: Vec<Vec<f32>>,
    labels: Vec<u32>,
}

impl Candidates {
    fn new(samples: &[Places], classes: &[usize], mirrored_classes: &[usize]) -> Result<Self, RecognitionError> {
        let angles = Angle::all();
        let position = |angle: &Angle| angles.binary_search_by_key(&key(&angle.mirrored()), key).unwrap_or(0);
        let mirrored: Vec<usize> = angles.iter().map(position).collect();
        let step = samples.len().div_ceil(SAMPLES_MOST).max(1);
        let labelled = samples.iter().zip(classes.iter().zip(mirrored_classes)).step_by(step);
        let rows: Vec<(Vec<f64>, usize, usize)> = labelled
            .filter_map(|(places, (&own, &image))| Some((complete_descriptor(&angles, places).ok()?, own, image)))
            .collect();
        if rows.is_empty() {
            return Err(RecognitionError::NoSamples { angles: angles.len() });
        }
        let labels: Vec<u32> = rows.iter().map(|row| row.1 as u32).chain(rows.iter().map(|row| row.2 as u32)).collect();
        if labels.iter().all(|label| *label == labels[0]) {
            return Err(RecognitionError::OneClass { samples: rows.len() });
        }
        let column = |k: usize| {
            let images = rows.iter().map(move |row| row.0[k]);
            images.map(|angle| angle as f32)
        };
        let columns = (0..angles.len()).map(|k| column(k).chain(column(mirrored[k])).collect()).collect();
        Ok(Self { mirrored, columns, labels, angles })
    }

    /// One angle of each pair of mirror images: the first.
    fn pairs(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.angles.len()).filter(|&k| k <= self.mirrored[k])
    }

    /// The angles that a tree uses of these and their mirror images, most important first, with their importance.
    fn ranked(&self, pairs: &[usize]) -> Result<Vec<(usize, f64)>, RecognitionError> {
        let mut used: Vec<usize> = pairs.iter().flat_map(|&k| [k, self.mirrored[k]]).collect();
        used.sort_unstable();
        used.dedup();
        if used.is_empty() {
            return Ok(Vec::new());
        }
        let failed = |error: smartcore::error::Failed| RecognitionError::Training { reason: error.to_string() };
        let values = used.iter().flat_map(|&k| &self.columns[k]).copied().collect();
        let matrix = DenseMatrix::new(self.labels.len(), used.len(), values, true).map_err(failed)?;
        let parameters = DecisionTreeClassifierParameters::default()
            .with_min_samples_leaf(LEAF_LEAST)
            .with_min_samples_split(2 * LEAF_LEAST)
            .with_max_depth(DEPTH_MOST);
        let tree = DecisionTreeClassifier::fit(&matrix, &self.labels, parameters).map_err(failed)?;
        let mut importances = vec![0.0; self.angles.len()];
        for (&k, importance) in used.iter().zip(tree.compute_feature_importances(false)) {
            importances[k.min(self.mirrored[k])] += importance;
        }
        let sum: f64 = importances.iter().sum();
        let mut ranked: Vec<(usize, f64)> =
            pairs.iter().map(|&k| (k, importances[k] / sum)).filter(|(_, importance)| *importance > 0.0).collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        Ok(ranked)
    }

    fn variance(&self, k: usize) -> f64 {
        let values = || self.columns[k].iter().map(|&value| f64::from(value));
        let count = self.labels.len() as f64;
        let mean = values().sum::<f64>() / count;
        values().map(|value| (value - mean).powi(2)).sum::<f64>() / count
    }
}

/// The order of [`Angle::all`].
fn key(angle: &Angle) -> [usize; 3] {
    [angle.marker, angle.from, angle.to].map(|landmark| landmark.index())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::recognition::recognizer::Recognizer;
    use crate::drive::recognition::synthetic::frames;

    /// Samples whose mirror images are classes of their own.
    fn labelled(count: usize, per_class: usize, seed: u64) -> (Vec<Places>, Vec<usize>, Vec<usize>) {
        let (places, classes) = frames(count, per_class, 0.1, seed);
        let images = classes.iter().map(|class| count + class).collect();
        (places, classes, images)
    }

    #[test]
    fn angles_are_selected_in_pairs_and_tell_classes_apart() {
        let (places, classes, images) = labelled(6, 8, 16);
        let selected = select_angles(&places, &classes, &images, 20).unwrap();
        assert_eq!(selected, select_angles(&places, &classes, &images, 20).unwrap());
        assert!((19..=20).contains(&selected.len()));
        let angles: Vec<Angle> = selected.iter().map(|s| s.angle).collect();
        assert!(angles.iter().all(|angle| angles.contains(&angle.mirrored())));
        assert!(angles.iter().enumerate().all(|(k, angle)| !angles[..k].contains(angle)));
        assert!(selected.is_sorted_by(|a, b| (a.tree, -a.importance) <= (b.tree, -b.importance)));
        assert!(selected.iter().all(|s| s.importance > 0.0 && s.variance > 0.0));
        let recognizer = Recognizer::train(&places, &classes, &angles).unwrap();
        let (others, truth) = frames(6, 20, 0.1, 17);
        let right = others.iter().zip(&truth).filter(|(p, c)| recognizer.recognize(p).unwrap().class == **c);
        assert!(right.count() as f64 >= 0.95 * others.len() as f64);
    }
    #[test]
    fn what_has_no_classes_is_refused() {
        let (mut places, classes, images) = labelled(2, 3, 18);
        let failure = select_angles(&places, &classes, &images[1..], 20).unwrap_err();
        assert_eq!(failure, RecognitionError::LabelCount { samples: 6, labels: 5 });
        let failure = select_angles(&places, &[4; 6], &[4; 6], 20).unwrap_err();
        assert_eq!(failure, RecognitionError::OneClass { samples: 6 });
        places.iter_mut().for_each(|places| places[0] = None);
        assert!(matches!(select_angles(&places, &classes, &images, 20), Err(RecognitionError::NoSamples { .. })));
    }
}
