//! Stature and girths of a shape, and how uncertain they are.

use crate::body::{BodyMeasure, BodyModel, Shape, Stance, body_measures, skin};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// A measure of a body, and how certain it is.
#[derive(Clone, Debug, PartialEq)]
pub struct UncertainMeasure {
    /// The measure.
    pub measure: BodyMeasure,
    /// Its standard deviation in metres.
    pub deviation: f64,
}

/// The stature of the mean body, and its derivative by each shape coordinate: stature is linear but for a millimetre.
///
/// **Shapes** K derivatives, metres per standard deviation.
pub(super) fn stature_of(model: &BodyModel) -> (f64, Vec<f64>) {
    let at = |k: usize, beta: f64| {
        let mut shape = model.mean_shape();
        shape.0[k] = beta;
        stature(model, &shape)
    };
    let per_beta: Vec<f64> =
        (0..model.component_count()).into_par_iter().map(|k| 0.5 * (at(k, 1.0) - at(k, -1.0))).collect();
    (stature(model, &model.mean_shape()), per_beta)
}

/// The stature of a shape: the extent of the body that stands upright, as [`body_measures`] takes it.
fn stature(model: &BodyModel, shape: &Shape) -> f64 {
    let (mesh, skeleton) = model.shaped(shape);
    let standing = skin(mesh.points(), &model.weights, &skeleton, &Stance::Upright.pose(&skeleton));
    let ys = || standing.iter().map(|p| p.y);
    ys().fold(f64::NEG_INFINITY, f64::max) - ys().fold(f64::INFINITY, f64::min)
}

/// The measures of a shape with their standard deviations, to first order in the shape's covariance.
///
/// **Shapes** `covariance` K × K.
pub(super) fn spread_of(model: &BodyModel, shape: &Shape, covariance: &DMatrix<f64>) -> Vec<UncertainMeasure> {
    /// Step of the difference quotients, in standard deviations: over it a girth changes by more than its rounding.
    const STEP: f64 = 0.5;
    let of = |shape: &Shape| {
        let (mesh, skeleton) = model.shaped(shape);
        body_measures(&mesh, &model.weights, &skeleton)
    };
    let moved: Vec<[Vec<BodyMeasure>; 2]> = (0..model.component_count())
        .into_par_iter()
        .map(|k| {
            [-STEP, STEP].map(|by| {
                let mut other = shape.clone();
                other.0[k] += by;
                of(&other)
            })
        })
        .collect();
    let named = |list: &[BodyMeasure], name: &str| list.iter().find(|m| m.name == name).map(|m| m.metres);
    let spread = |measure: &BodyMeasure| {
        let slope = |[low, high]: &[Vec<BodyMeasure>; 2]| {
            let [low, high] = [named(low, &measure.name), named(high, &measure.name)];
            low.zip(high).map_or(0.0, |(low, high)| (high - low) / (2.0 * STEP))
        };
        let gradient = DVector::from_iterator(moved.len(), moved.iter().map(slope));
        (gradient.transpose() * covariance * &gradient)[0].max(0.0).sqrt()
    };
    of(shape).into_iter().map(|measure| UncertainMeasure { deviation: spread(&measure), measure }).collect()
}
