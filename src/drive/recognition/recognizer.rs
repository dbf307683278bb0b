//! Recognises poses: a support vector machine finds the class, and nearest neighbours the most similar poses in it.
//!
//! **Source** Lifkooee 2019, §3.3; Platt 1998 and Fan 2005 for the solver, in `linfa-svm`. One machine per pair of classes
//! votes. All machines share their support vectors, the training poses, so the kernel is computed once per training pose and
//! not once per machine: with 30 classes that is less than a tenth of the work. smartcore's machine takes twenty times as long to train,
//! and cannot be kept, because it borrows its data.

use super::descriptor::{Angle, complete_descriptor, descriptor};
use super::error::RecognitionError;
use crate::drive::landmark::Places;
use linfa::DatasetBase;
use linfa::traits::Fit;
use linfa_svm::Svm;
use ndarray::{Array1, Array2};
use rayon::prelude::*;

/// Neighbours that are reported.
pub const NEIGHBORS: usize = 4;
/// The penalty of training poses on the wrong side of the margin. Measured with 30 classes of 990 synthetic poses, with gaps
/// between the classes and without: with 1 up to 5 percentage points fewer poses are recognised, with 100 at most 1 more.
const C: f64 = 10.0;
/// Violation of the optimality conditions at which a machine is trained: LIBSVM's default.
const TOLERANCE: f64 = 1e-3;
/// Least standard deviation by which an angle is divided, in radians: 1°. What varies less is mostly noise of the sensors.
const LEAST_DEVIATION: f64 = std::f64::consts::PI / 180.0;
/// Weights below this share of `C` are none.
const LEAST_WEIGHT: f64 = 1e-12;

/// Recognises poses by their descriptors.
#[derive(Clone, Debug)]
pub struct Recognizer {
    angles: Vec<Angle>,
    /// Descriptors of the training poses, row by row, in radians.
    descriptors: Vec<f64>,
    /// Standardises each angle: one over its standard deviation.
    scales: Vec<f64>,
    /// The label of each class, ascending.
    labels: Vec<usize>,
    /// The training poses of each class.
    members: Vec<Vec<usize>>,
    machines: Vec<Machine>,
}

/// Separates two classes: the sign of `Σ weight · kernel − threshold`, positive for the first.
#[derive(Clone, Debug)]
struct Machine {
    classes: [usize; 2],
    /// Training poses with their weights.
    support: Vec<(u32, f64)>,
    threshold: f64,
}

/// What a pose was recognised as.
#[derive(Clone, Debug, PartialEq)]
pub struct Recognized {
    /// The class.
    pub class: usize,
    /// The most similar training poses of this class, nearest first, with the root mean square difference of the angles, in
    /// radians.
    pub nearest: Vec<(usize, f64)>,
}

impl Recognizer {
    /// Learns classes of poses.
    ///
    /// **Shapes** `classes`: one label per sample; labels need not be consecutive.
    ///
    /// **Errors** no samples or no angles, another number of labels, or a landmark of a sample is lost.
    ///
    /// **Guarantees** equal results with any number of threads.
    pub fn train(samples: &[Places], classes: &[usize], angles: &[Angle]) -> Result<Self, RecognitionError> {
        if samples.len() != classes.len() {
            return Err(RecognitionError::LabelCount { samples: samples.len(), labels: classes.len() });
        }
        if samples.is_empty() || angles.is_empty() {
            return Err(RecognitionError::NoSamples { angles: angles.len() });
        }
        let mut descriptors = Vec::with_capacity(samples.len() * angles.len());
        for (sample, places) in samples.iter().enumerate() {
            let undefined = |angle| RecognitionError::UndefinedAngle { sample, angle };
            descriptors.extend(complete_descriptor(angles, places).map_err(undefined)?);
        }
        let mut labels = classes.to_vec();
        labels.sort_unstable();
        labels.dedup();
        let of_class = |label: &usize| (0..classes.len()).filter(|&i| classes[i] == *label).collect();
        let members: Vec<Vec<usize>> = labels.iter().map(of_class).collect();
        let scales = scales(&descriptors, angles.len());
        let pairs: Vec<[usize; 2]> = (0..labels.len()).flat_map(|b| (0..b).map(move |a| [a, b])).collect();
        let machine = |&classes: &[usize; 2]| Machine::train(classes, &members, &descriptors, &scales);
        let machines = pairs.par_iter().map(machine).collect::<Result<Vec<_>, _>>()?;
        Ok(Self { angles: angles.to_vec(), descriptors, scales, labels, members, machines })
    }

    /// The angles of the descriptor.
    pub fn angles(&self) -> &[Angle] {
        &self.angles
    }

    /// The class of a pose, and the [`NEIGHBORS`] training poses of it that are most similar.
    ///
    /// `None` if so many landmarks are lost that no angle is defined. Angles that are not defined do not count in the
    /// distances; for the class they are taken from the training pose that is most similar in the other angles.
    pub fn recognize(&self, places: &Places) -> Option<Recognized> {
        self.recognize_with(places, NEIGHBORS)
    }

    /// As [`Recognizer::recognize`], with another number of neighbours. There are fewer if the class has fewer poses.
    pub fn recognize_with(&self, places: &Places, neighbors: usize) -> Option<Recognized> {
        let seen = descriptor(&self.angles, places);
        if seen.iter().all(Option::is_none) {
            return None;
        }
        let distances: Vec<f64> = self.rows().map(|row| distance(&seen, row)).collect();
        let class = self.class_of(&self.filled(&seen, &distances));
        let mut nearest: Vec<(usize, f64)> = self.members[class].iter().map(|&i| (i, distances[i])).collect();
        nearest.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        nearest.truncate(neighbors);
        Some(Recognized { class: self.labels[class], nearest })
    }

    fn rows(&self) -> std::slice::ChunksExact<'_, f64> {
        self.descriptors.chunks_exact(self.angles.len())
    }

    /// The descriptor, with undefined angles from the nearest training pose.
    fn filled(&self, seen: &[Option<f64>], distances: &[f64]) -> Vec<f64> {
        let nearest = distances.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(i, _)| i);
        let row = &self.descriptors[nearest * self.angles.len()..][..self.angles.len()];
        seen.iter().zip(row).map(|(seen, other)| seen.unwrap_or(*other)).collect()
    }

    /// The class with most votes; of equal ones that with the greater sum of margins.
    fn class_of(&self, descriptor: &[f64]) -> usize {
        let kernel: Vec<f64> = self.rows().map(|row| kernel(descriptor, row, &self.scales)).collect();
        let mut votes = vec![(0, 0.0); self.labels.len()];
        for machine in &self.machines {
            let margin = machine.margin(&kernel);
            let [first, second] = machine.classes;
            votes[if margin > 0.0 { first } else { second }].0 += 1;
            votes[first].1 += margin;
            votes[second].1 -= margin;
        }
        let order = |a: &(usize, f64), b: &(usize, f64)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1));
        votes.iter().enumerate().max_by(|a, b| order(a.1, b.1)).map_or(0, |(class, _)| class)
    }
}

impl Machine {
    fn train(
        classes: [usize; 2],
        members: &[Vec<usize>],
        descriptors: &[f64],
        scales: &[f64],
    ) -> Result<Self, RecognitionError> {
        let samples: Vec<usize> = classes.iter().flat_map(|&class| &members[class]).copied().collect();
        let standardized = |(i, k): (usize, usize)| descriptors[samples[i] * scales.len() + k] * scales[k];
        let records = Array2::from_shape_fn((samples.len(), scales.len()), standardized);
        let is_first = Array1::from_shape_fn(samples.len(), |i| i < members[classes[0]].len());
        let fitted = Svm::<f64, bool>::params()
            .pos_neg_weights(C, C)
            .gaussian_kernel(scales.len() as f64)
            .eps(TOLERANCE)
            .fit(&DatasetBase::new(records, is_first))
            .map_err(|error| RecognitionError::Training { reason: error.to_string() })?;
        let weights = samples.iter().zip(&fitted.alpha).filter(|(_, weight)| weight.abs() > LEAST_WEIGHT * C);
        let support = weights.map(|(&sample, &weight)| (sample as u32, weight)).collect();
        Ok(Self { classes, support, threshold: fitted.rho })
    }

    fn margin(&self, kernel: &[f64]) -> f64 {
        self.support.iter().map(|&(sample, weight)| weight * kernel[sample as usize]).sum::<f64>() - self.threshold
    }
}

/// One over the standard deviation of each angle.
fn scales(descriptors: &[f64], size: usize) -> Vec<f64> {
    let count = (descriptors.len() / size) as f64;
    let column = |k: usize| descriptors.iter().skip(k).step_by(size);
    let deviation = |k: usize| {
        let mean = column(k).sum::<f64>() / count;
        (column(k).map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()
    };
    (0..size).map(|k| 1.0 / deviation(k).max(LEAST_DEVIATION)).collect()
}

/// `exp(−γ |a − b|²)` of standardised angles with γ = 1/d: then two unrelated poses, whose angles differ by √2 deviations
/// each, have the kernel e⁻², whatever the number d of angles. Measured as [`C`]: a third of γ
/// changes the share of recognised poses by 0 to 3 percentage points, three times γ costs 2 to 8.
fn kernel(a: &[f64], b: &[f64], scales: &[f64]) -> f64 {
    let squared: f64 = a.iter().zip(b).zip(scales).map(|((a, b), scale)| ((a - b) * scale).powi(2)).sum();
    (-squared / scales.len() as f64).exp()
}

/// The root mean square difference of the angles that are defined, in radians.
fn distance(seen: &[Option<f64>], row: &[f64]) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for (seen, other) in seen.iter().zip(row) {
        if let Some(seen) = seen {
            sum += (seen - other) * (seen - other);
            count += 1;
        }
    }
    (sum / count.max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::landmark::Landmark;
    use crate::drive::recognition::confusion::Confusion;
    use crate::drive::recognition::synthetic::{frames, moved};
    use linfa::traits::PredictInplace;

    /// 40 angles of limbs, with their mirror images.
    fn angles() -> Vec<Angle> {
        let of_left = Angle::all().into_iter().filter(|a| a.marker.side().is_some()).step_by(67).take(20);
        of_left.flat_map(|angle| [angle, angle.mirrored()]).collect()
    }

    fn confusion(recognizer: &Recognizer, places: &[Places], classes: &[usize]) -> Confusion {
        let mut confusion = Confusion::new(0);
        for (places, class) in places.iter().zip(classes) {
            confusion.add(*class, recognizer.recognize(places).unwrap().class);
        }
        confusion
    }

    #[test]
    fn jittered_poses_are_recognised_whoever_makes_them_and_wherever() {
        let (places, classes) = frames(15, 20, 0.12, 7);
        let recognizer = Recognizer::train(&places, &classes, &angles()).unwrap();
        let (others, truth) = frames(15, 10, 0.12, 8);
        let others: Vec<Places> = others.iter().enumerate().map(|(k, p)| moved(p, k as u64)).collect();
        let found = confusion(&recognizer, &others, &truth);
        assert!(found.accuracy() >= 0.95, "{}", found.accuracy());
        let itself = recognizer.recognize(&places[33]).unwrap();
        assert_eq!((itself.class, itself.nearest.len(), itself.nearest[0]), (classes[33], NEIGHBORS, (33, 0.0)));
        assert!(itself.nearest.iter().all(|&(sample, _)| classes[sample] == itself.class));
        assert!(itself.nearest.is_sorted_by_key(|(_, distance)| *distance));
    }
    #[test]
    fn lost_landmarks_are_tolerated_down_to_none() {
        let (places, classes) = frames(10, 20, 0.08, 9);
        let recognizer = Recognizer::train(&places, &classes, &angles()).unwrap();
        let (mut others, truth) = frames(10, 10, 0.08, 10);
        for (k, places) in others.iter_mut().enumerate() {
            places[(k * 7) % 16] = None;
            places[(k * 5 + 3) % 16] = None;
        }
        let found = confusion(&recognizer, &others, &truth);
        assert!(found.accuracy() >= 0.9, "{}", found.accuracy());
        assert_eq!(recognizer.recognize(&[None; _]), None);
        let mut only = [None; _];
        for landmark in [angles()[0].marker, angles()[0].from, angles()[0].to] {
            only[landmark.index()] = others[1][landmark.index()].or(places[0][landmark.index()]);
        }
        assert!(recognizer.recognize(&only).is_some());
    }
    #[test]
    fn training_is_deterministic_and_labels_are_kept() {
        let (places, classes) = frames(6, 8, 0.2, 11);
        let sparse: Vec<usize> = classes.iter().map(|class| 10 * class + 3).collect();
        let a = Recognizer::train(&places, &classes, &angles()).unwrap();
        let b = Recognizer::train(&places, &sparse, &angles()).unwrap();
        for places in &frames(6, 5, 0.3, 12).0 {
            let (a, b) = (a.recognize(places).unwrap(), b.recognize(places).unwrap());
            assert_eq!((10 * a.class + 3, a.nearest), (b.class, b.nearest));
        }
        let one = Recognizer::train(&places, &[5; 48], &angles()).unwrap();
        assert_eq!(one.recognize_with(&places[4], 2).unwrap().nearest[0].0, 4);
    }
    #[test]
    fn shared_kernels_give_the_library_s_own_decisions() {
        let (places, classes) = frames(2, 30, 0.4, 13);
        let angles = angles();
        let recognizer = Recognizer::train(&places, &classes, &angles).unwrap();
        let record = |places: &Places, k: usize| angles[k].of(places).unwrap() * recognizer.scales[k];
        let records = |of: &[Places]| Array2::from_shape_fn((of.len(), angles.len()), |(i, k)| record(&of[i], k));
        let targets = Array1::from_iter(classes.iter().map(|class| *class == 0));
        let params = Svm::<f64, bool>::params().pos_neg_weights(C, C).gaussian_kernel(angles.len() as f64);
        let theirs = params.eps(TOLERANCE).fit(&DatasetBase::new(records(&places), targets)).unwrap();
        let others = frames(2, 50, 0.8, 14).0;
        let mut decisions = Array1::from_elem(others.len(), false);
        theirs.predict_inplace(&records(&others), &mut decisions);
        assert!(decisions.iter().any(|first| *first) && decisions.iter().any(|first| !*first));
        for (places, first) in others.iter().zip(decisions) {
            assert_eq!(recognizer.recognize(places).unwrap().class == 0, first);
        }
    }
    #[test]
    fn what_cannot_be_learnt_from_is_refused() {
        let (mut places, classes) = frames(2, 2, 0.1, 15);
        let angles = angles();
        let failure = |places: &[Places], classes: &[usize], angles: &[Angle]| {
            Recognizer::train(places, classes, angles).map(|_| ()).unwrap_err()
        };
        assert!(matches!(failure(&places, &[1], &angles), RecognitionError::LabelCount { samples: 4, labels: 1 }));
        assert!(matches!(failure(&places, &classes, &[]), RecognitionError::NoSamples { .. }));
        assert!(matches!(failure(&[], &[], &angles), RecognitionError::NoSamples { .. }));
        places[2][Landmark::index(angles[1].marker)] = None;
        assert!(matches!(failure(&places, &classes, &angles), RecognitionError::UndefinedAngle { sample: 2, .. }));
    }
}
