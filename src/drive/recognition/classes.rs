//! Classes of poses: clusters of the directions of the body's segments.
//!
//! The paper's data sets come with labelled poses; ours are frames of motion clips, so classes are found by k-means.
//!
//! **Source** Lloyd 1982; seeds as in the BUILD phase of PAM, Kaufman and Rousseeuw 1990, which needs no random numbers.
//! Seeds that are farthest from each other (Gonzalez 1985) are outliers, and some classes then have one or two poses.
//! smartcore's k-means draws its seeds at random.

use crate::body::Side::{Left, Right};
use crate::drive::landmark::{DESCRIBED, Landmark, Places};
use crate::geometry::Vec3;
use nalgebra::Matrix3;

/// Rounds after which k-means stops, converged or not: some 20 suffice, the rest is a safeguard.
const ROUNDS_MOST: usize = 100;

/// Samples that may be seeds; of more, every n-th. Their distances to all samples are kept, 16 MB for 2000 samples.
const CANDIDATES_MOST: usize = 1000;

/// What poses are compared by when classes are formed: the directions of the segments from each of the first [`DESCRIBED`]
/// landmarks to its parent, in the frame of the pelvis, with equal weights.
///
/// **Shapes** three per segment: 45.
///
/// **Frame and units** unit vectors; x from the right hip to the left, y towards the chest, z forward.
///
/// **Guarantees** they do not change when the person moves, turns or is of another size. `None` if a landmark is lost.
pub fn pose_features(places: &Places) -> Option<Vec<f64>> {
    let at = |landmark: Landmark| places[landmark.index()];
    /// Shorter vectors have no direction, in metres.
    const SHORTEST: f64 = 1e-6;
    let x = (at(Landmark::Hip(Left))? - at(Landmark::Hip(Right))?).try_normalize(SHORTEST)?;
    let z = x.cross(&(at(Landmark::Chest)? - at(Landmark::Pelvis)?)).try_normalize(SHORTEST)?;
    let pelvis_from_world = Matrix3::from_columns(&[x, z.cross(&x), z]).transpose();
    let mut features = Vec::with_capacity(3 * (DESCRIBED - 1));
    for &landmark in &Landmark::ALL[..DESCRIBED] {
        let Some(parent) = landmark.parent() else { continue };
        let direction: Vec3 = pelvis_from_world * (at(landmark)? - at(parent)?).try_normalize(SHORTEST)?;
        features.extend(direction.iter());
    }
    Some(features)
}

/// Classes of poses.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseClasses {
    /// The mean of each class's features.
    ///
    /// **Shapes** classes × features.
    pub centers: Vec<Vec<f64>>,
    /// The class of each sample.
    pub labels: Vec<usize>,
}

impl PoseClasses {
    /// Divides samples into `count` classes, or fewer if there are fewer distinct samples.
    ///
    /// **Requires** features of equal length.
    ///
    /// **Guarantees** deterministic; no class is empty.
    pub fn cluster(features: &[Vec<f64>], count: usize) -> Self {
        let mut centers = seeds(features, count);
        let mut labels: Vec<usize> = Vec::new();
        for _ in 0..ROUNDS_MOST {
            let nearest: Vec<usize> = features.iter().map(|f| nearest_center(&centers, f).0).collect();
            if nearest == labels {
                break;
            }
            labels = nearest;
            update(&mut centers, features, &labels);
        }
        without_empty(centers, labels)
    }

    /// The class of a pose that was not among the samples.
    pub fn nearest(&self, features: &[f64]) -> usize {
        nearest_center(&self.centers, features).0
    }

    /// How many samples each class has.
    pub fn sizes(&self) -> Vec<usize> {
        let mut sizes = vec![0; self.centers.len()];
        for &label in &self.labels {
            sizes[label] += 1;
        }
        sizes
    }
}

/// Always the sample that decreases the sum of squared distances to the nearest seed most.
fn seeds(features: &[Vec<f64>], count: usize) -> Vec<Vec<f64>> {
    let step = features.len().div_ceil(CANDIDATES_MOST).max(1);
    let candidates: Vec<&Vec<f64>> = features.iter().step_by(step).collect();
    let to_all = |candidate: &&Vec<f64>| features.iter().map(|f| squared_distance(candidate, f)).collect();
    let distances: Vec<Vec<f64>> = candidates.iter().map(to_all).collect();
    let mut to_seeds = vec![f64::INFINITY; features.len()];
    let mut seeds: Vec<Vec<f64>> = Vec::new();
    while seeds.len() < count {
        let with = |to_one: &Vec<f64>| to_one.iter().zip(&to_seeds).map(|(a, b)| a.min(*b)).sum::<f64>();
        let sums = distances.iter().map(with).enumerate();
        let Some((best, sum)) = sums.min_by(|a, b| a.1.total_cmp(&b.1)) else { break };
        if sum >= to_seeds.iter().sum::<f64>() {
            break;
        }
        to_seeds.iter_mut().zip(&distances[best]).for_each(|(least, to_one)| *least = least.min(*to_one));
        seeds.push(candidates[best].clone());
    }
    seeds
}

/// Moves each center to the mean of its samples; without samples it remains.
fn update(centers: &mut [Vec<f64>], features: &[Vec<f64>], labels: &[usize]) {
    for (class, center) in centers.iter_mut().enumerate() {
        let of_class = || labels.iter().zip(features).filter(|(label, _)| **label == class).map(|(_, f)| f);
        let count = of_class().count();
        if count == 0 {
            continue;
        }
        center.fill(0.0);
        for f in of_class() {
            center.iter_mut().zip(f).for_each(|(sum, value)| *sum += value);
        }
        center.iter_mut().for_each(|sum| *sum /= count as f64);
    }
}

fn nearest_center(centers: &[Vec<f64>], features: &[f64]) -> (usize, f64) {
    let distances = centers.iter().map(|center| squared_distance(center, features));
    distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0))
}

fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

fn without_empty(centers: Vec<Vec<f64>>, labels: Vec<usize>) -> PoseClasses {
    let is_used: Vec<bool> = (0..centers.len()).map(|class| labels.contains(&class)).collect();
    let new = |old: usize| is_used[..old].iter().filter(|used| **used).count();
    let labels = labels.iter().map(|&label| new(label)).collect();
    let centers = centers.into_iter().zip(&is_used).filter(|(_, used)| **used).map(|(center, _)| center).collect();
    PoseClasses { centers, labels }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::recognition::synthetic::{frames, moved};

    #[test]
    fn features_do_not_change_with_place_heading_and_size() {
        for (k, places) in frames(3, 2, 0.2, 4).0.iter().enumerate() {
            let (a, b) = (pose_features(places).unwrap(), pose_features(&moved(places, k as u64)).unwrap());
            assert_eq!(a.len(), 45);
            assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-9));
        }
    }
    #[test]
    fn separate_poses_become_classes() {
        let (places, truth) = frames(12, 20, 0.05, 5);
        let features: Vec<_> = places.iter().map(|p| pose_features(p).unwrap()).collect();
        let classes = PoseClasses::cluster(&features, 12);
        assert_eq!(classes, PoseClasses::cluster(&features, 12));
        assert_eq!(classes.sizes(), [20; 12]);
        for (a, x) in truth.iter().zip(&classes.labels) {
            assert!(truth.iter().zip(&classes.labels).all(|(b, y)| (a == b) == (x == y)));
        }
        let (others, truth_of_others) = frames(12, 3, 0.05, 6);
        for (place, class) in others.iter().zip(truth_of_others) {
            assert_eq!(classes.nearest(&pose_features(place).unwrap()), classes.labels[20 * class]);
        }
    }
    #[test]
    fn few_samples_give_few_classes() {
        assert!(PoseClasses::cluster(&[], 5).labels.is_empty());
        let twice = vec![vec![1.0, 2.0], vec![1.0, 2.0], vec![0.0, 0.0]];
        let classes = PoseClasses::cluster(&twice, 5);
        assert_eq!(classes.centers.len(), 2);
        assert!(classes.labels[0] == classes.labels[1] && classes.labels[0] != classes.labels[2]);
    }
}
