//! Measures of the person that are known: told, or measured with a tape.

use crate::body::{BodyMeasure, BodyModel, Shape, body_measures};
use nalgebra::{DMatrix, DVector};

/// A measure of the person: metres, the weight in kilograms.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct KnownMeasure {
    /// As [`body_measures`] names it: `chest girth`; or `weight`.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard deviation: two people with a tape differ by 1 to 2 cm.
    pub deviation: f64,
}

/// The measures of a shape and how they change with its coefficients, linearised.
pub(super) struct MeasuredShape {
    pub names: Vec<String>,
    pub values: DVector<f64>,
    /// **Shapes** measures × K.
    pub by_shape: DMatrix<f64>,
}

/// Measures a shape with central differences of half a standard deviation.
pub(super) fn measured(model: &BodyModel, shape: &Shape) -> MeasuredShape {
    use rayon::prelude::*;
    const STEP: f64 = 0.5;
    /// Kilograms per cubic metre with air in the lungs.
    const DENSITY: f64 = 985.0;
    let of = |shape: &Shape| {
        let (mesh, skeleton) = model.shaped(shape);
        let mut taken = body_measures(&mesh, &model.weights, &skeleton);
        taken.push(BodyMeasure { name: "weight".into(), metres: DENSITY * mesh.signed_volume() });
        taken
    };
    let at = of(shape);
    let names: Vec<String> = at.iter().map(|m| m.name.clone()).collect();
    let in_order = |shape: &Shape| -> Vec<f64> {
        let taken = of(shape);
        let find = |(name, m): (&String, f64)| taken.iter().find(|t| t.name == *name).map_or(m, |t| t.metres);
        names.iter().zip(at.iter().map(|m| m.metres)).map(find).collect()
    };
    let columns: Vec<Vec<f64>> = (0..model.component_count())
        .into_par_iter()
        .map(|k| {
            let moved = |by: f64| {
                let mut shape = shape.clone();
                shape.0[k] += by;
                in_order(&shape)
            };
            let (more, less) = (moved(STEP), moved(-STEP));
            more.iter().zip(&less).map(|(a, b)| (a - b) / (2.0 * STEP)).collect()
        })
        .collect();
    let by_shape = DMatrix::from_fn(names.len(), columns.len(), |m, k| columns[k][m]);
    MeasuredShape { values: DVector::from_iterator(names.len(), at.iter().map(|m| m.metres)), names, by_shape }
}

impl MeasuredShape {
    pub(super) fn row(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }
}
