//! The measures of a body model or of a mesh of a person.

use super::error::BodiesError;
use crate::body::{BodyMeasure, Shape, body_measures};
use crate::fit::{NakedParams, RegisterParams, fit_naked, register};
use crate::scan::{ScanParams, clean};
use crate::session::{read_body_model, read_mesh_file};
use std::path::Path;

/// The measures of a model's body; an empty shape is the mean.
pub fn model_measures(model: Option<&Path>, shape: &[f64]) -> Result<Vec<BodyMeasure>, BodiesError> {
    let model = read_body_model(model)?;
    if shape.len() > model.component_count() {
        return Err(BodiesError::BadRequest {
            what: format!("{} shape coordinates for a model with {}", shape.len(), model.component_count()),
            hint: "give as many as the model has components, or fewer".into(),
        });
    }
    let (mesh, skeleton) = model.shaped(&Shape(shape.to_vec()));
    Ok(body_measures(&mesh, &model.weights, &skeleton))
}

/// The measures of a mesh of a bare person: a model is fitted and registered to it, and the result is measured.
pub fn mesh_measures(path: &Path, model: Option<&Path>) -> Result<Vec<BodyMeasure>, BodiesError> {
    let model = read_body_model(model)?;
    let raw = read_mesh_file(path)?;
    let scan = clean(&raw, &ScanParams::default(), &mut |_| {}).map_err(|e| BodiesError::bad_source(path, e))?;
    let fitted =
        fit_naked(&scan, &model, &NakedParams::default(), &mut |_| {}).map_err(|e| BodiesError::bad_source(path, e))?;
    let registered = register(&scan, &model, &fitted, &RegisterParams::default(), &mut |_| {})
        .map_err(|e| BodiesError::bad_source(path, e))?;
    Ok(body_measures(&registered.surface, &model.weights, &registered.skeleton))
}
