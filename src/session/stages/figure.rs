//! Figure: the body alone, or a garment weighed and put on the figure dressed so far.

use super::walk::{Outcome, Walk};
use crate::body::{Figure, Layer};
use crate::fit::{RegisteredBody, scan_in_bind};
use crate::geometry::TriMesh;
use crate::rig::{PhysicsParams, RiggedGarment, physics_weights};
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::recipe::{BODY_STEP, BodySurface, StepRecipe, garment_kind, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use serde_json::json;

/// The body alone.
pub(in crate::session) fn bare(
    walk: &mut Walk,
    step: &StepRecipe,
    scan: Kept<Scan>,
    registered: Kept<RegisteredBody>,
) -> Result<Kept<Figure>, SessionError> {
    let mut inputs = json!({ "registered": registered.hash, "model": walk.session().body_model_input() });
    if step.surface == Some(BodySurface::Scan) {
        inputs["scan"] = json!(scan.hash);
    }
    walk.stage(&step.name, Stage::Figure, inputs, |session, _tell| {
        let (mut registered, mut model) = (session.store.load(registered)?, session.body_model()?);
        if step.surface == Some(BodySurface::Scan) {
            let scan = session.store.load(scan)?;
            (registered.surface, model.weights) = scan_in_bind(&scan, &registered, &model.weights);
            (registered.colors, registered.uvs) = (scan.colors, None);
        }
        let body = Layer::plain(BODY_STEP, registered.surface, model.weights);
        let body = Layer { colors: registered.colors, uvs: registered.uvs, ..body };
        let vertices = body.mesh.vertex_count();
        let figure = Figure { skeleton: registered.skeleton, layers: vec![body] };
        Ok(Outcome::of(figure).measured("layers", 1.0).measured("vertices", vertices as f64))
    })
}

/// The figure dressed so far, with one garment more: weighed by its distance to the body (Hu 2017, Eq. 9).
pub(in crate::session) fn dressed(
    walk: &mut Walk,
    step: &StepRecipe,
    rigged: Kept<RiggedGarment>,
    stacked: Kept<TriMesh>,
    inner: Kept<Figure>,
) -> Result<Kept<Figure>, SessionError> {
    let params: PhysicsParams = params_of(step, Stage::Figure)?;
    let kind = garment_kind::of_step(step)?;
    let inputs = json!({
        "rigged": rigged.hash,
        "stacked": stacked.hash,
        "figure": inner.hash,
        "kind": kind.input(),
        "params": params,
    });
    walk.stage(&step.name, Stage::Figure, inputs, |session, _tell| {
        let (rigged, mesh) = (session.store.load(rigged)?, session.store.load(stacked)?);
        let mut figure = session.figure(inner)?;
        let loose = kind.template.loose_part(mesh.points(), figure.body(), &figure.skeleton);
        let physics = physics_weights(&mesh, &figure.body().mesh, &loose, &params)
            .map_err(|e| SessionError::stage(&step.name, Stage::Figure, e))?;
        figure.layers.push(Layer {
            name: step.name.clone(),
            template: Some(kind.template.name.clone()),
            mesh,
            weights: rigged.weights,
            colors: rigged.colors,
            uvs: None,
            physics: Some(physics.per_vertex),
            fabric: Some(kind.template.fabric.clone()),
        });
        let layers = figure.layers.len();
        Ok(Outcome::of(figure)
            .measured("layers", layers as f64)
            .measured("physics_of_fitted_part", physics.fitted_part.unwrap_or(f64::NAN))
            .measured("physics_of_loose_part", physics.loose_part.unwrap_or(f64::NAN)))
    })
}
