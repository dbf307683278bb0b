//! A body's measures: of a session, of a model, or of any mesh of a person.

use crate::body::{BodyMeasure, Shape, body_measures};
use crate::fit::{NakedParams, RegisterParams, fit_naked, register};
use crate::formats::{MeshKind, read_mesh};
use crate::scan::{ScanParams, clean};
use crate::session::error::SessionError;
use crate::session::open::{Session, read_body_model, source};
use crate::session::recipe::BODY_STEP;
use std::io::Cursor;
use std::path::Path;

impl Session {
    /// The measures of the body as registered to the naked scan.
    ///
    /// **Errors** where the body is not built.
    pub fn body_measures(&self) -> Result<Vec<BodyMeasure>, SessionError> {
        let steps = self.posed_steps(Some(BODY_STEP))?;
        Ok(steps.first().map_or_else(Vec::new, |posed| {
            let body = posed.figure.body();
            body_measures(&body.mesh, &body.weights, &posed.figure.skeleton)
        }))
    }
}

/// The measures of a model's body; an empty shape is the mean.
pub fn model_measures(model: Option<&Path>, shape: &[f64]) -> Result<Vec<BodyMeasure>, SessionError> {
    let model = read_body_model(model)?;
    if shape.len() > model.component_count() {
        return Err(SessionError::BadRequest {
            what: format!("{} shape coordinates for a model with {}", shape.len(), model.component_count()),
            hint: "give as many as the model has components, or fewer".into(),
        });
    }
    let (mesh, skeleton) = model.shaped(&Shape(shape.to_vec()));
    Ok(body_measures(&mesh, &model.weights, &skeleton))
}

/// The measures of a mesh of a bare person: a model is fitted and moved onto it, and measured in its stead.
pub fn mesh_measures(path: &Path, model: Option<&Path>) -> Result<Vec<BodyMeasure>, SessionError> {
    let model = read_body_model(model)?;
    let bytes = source::read(path)?;
    let failed = |e: crate::formats::FormatError| SessionError::bad_source(path, e);
    let extension = path.extension().unwrap_or_default().to_string_lossy().into_owned();
    let kind = MeshKind::from_extension(&extension).map_err(failed)?;
    let raw = read_mesh(kind, Cursor::new(bytes)).map_err(failed)?;
    let scan = clean(&raw, &ScanParams::default(), &mut |_| {}).map_err(|e| SessionError::bad_source(path, e))?;
    let fitted = fit_naked(&scan, &model, &NakedParams::default(), &mut |_| {})
        .map_err(|e| SessionError::bad_source(path, e))?;
    let registered = register(&scan, &model, &fitted, &RegisterParams::default(), &mut |_| {})
        .map_err(|e| SessionError::bad_source(path, e))?;
    Ok(body_measures(&registered.surface, &model.weights, &registered.skeleton))
}
