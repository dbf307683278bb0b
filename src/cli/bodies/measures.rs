//! The measures of a body model or of a mesh of a person.

use super::error::BodiesError;
use super::shape::check_shape;
use crate::body::{BodyMeasure, Shape, body_measures};
use crate::check::{BodyResult, check_body};
use crate::fit::{NakedParams, RegisterParams, fit_naked, register};
use crate::scan::{ScanParams, clean};
use crate::session::{read_body_model, read_mesh_file};
use std::path::Path;

/// The measures of a model's body; an empty shape is the mean.
pub fn model_measures(model: Option<&Path>, shape: &[f64]) -> Result<Vec<BodyMeasure>, BodiesError> {
    let model = read_body_model(model)?;
    check_shape(shape, &model)?;
    let (mesh, skeleton) = model.shaped(&Shape(shape.to_vec()));
    Ok(body_measures(&mesh, &model.weights, &skeleton))
}

/// The measures of a mesh of a person, and what is in doubt about them.
pub struct MeasuredMesh {
    /// The measures.
    pub measures: Vec<BodyMeasure>,
    /// Every doubt, the gravest first: one sentence each, with what to do.
    pub doubts: Vec<String>,
}

/// The measures of a mesh of a bare person: a model is fitted and registered to it, and the result is measured. Whether the
/// mesh shows a bare person who stands is checked as in a session.
pub fn mesh_measures(path: &Path, model: Option<&Path>) -> Result<MeasuredMesh, BodiesError> {
    let model = read_body_model(model)?;
    let raw = read_mesh_file(path)?;
    let scan = clean(&raw, &ScanParams::default(), &mut |_| {}).map_err(|e| BodiesError::bad_source(path, e))?;
    let fitted =
        fit_naked(&scan, &model, &NakedParams::default(), &mut |_| {}).map_err(|e| BodiesError::bad_source(path, e))?;
    let registered = register(&scan, &model, &fitted, &RegisterParams::default(), &mut |_| {})
        .map_err(|e| BodiesError::bad_source(path, e))?;
    let posed = model.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose);
    let checked = check_body(&BodyResult {
        hidden: fitted.hair.as_ref().map(|hair| &hair.covers),
        scan: &fitted.bare_part(&scan),
        fitted: &fitted.surface.with_points(posed),
        skeleton: &registered.skeleton,
        pose: &registered.pose,
        shape: &fitted.shape,
        weights: &model.weights,
    })
    .map_err(|e| BodiesError::bad_source(path, e))?;
    let fit = &fitted.report;
    let of_fit = (!fit.is_confident()).then(|| {
        format!("model and mesh agree badly, confidence {:.2} of 1; compare both in a viewer", fit.confidence)
    });
    let of_mesh = checked.doubts().into_iter().map(|doubt| format!("{}; {}", doubt.what, doubt.remedy));
    Ok(MeasuredMesh {
        measures: body_measures(&registered.surface, &model.weights, &registered.skeleton),
        doubts: of_mesh.chain(of_fit).collect(),
    })
}
