//! Figure: the body alone, or a garment weighed and put on the figure dressed so far.

use super::SessionError;
use super::recipe::{BODY_STEP, StepRecipe};
use super::state::Stage;
use super::store::Kept;
use super::walk::{Outcome, Walk};
use crate::body::{Figure, Layer};
use crate::fit::RegisteredBody;
use serde_json::json;

/// The body alone.
pub(super) fn bare(
    walk: &mut Walk,
    step: &StepRecipe,
    registered: Kept<RegisteredBody>,
) -> Result<Kept<Figure>, SessionError> {
    let inputs = json!({ "registered": registered.hash, "model": walk.session().body_model_input() });
    walk.stage(&step.name, Stage::Figure, inputs, |session, _tell| {
        let (registered, model) = (session.store.load(registered)?, session.body_model()?);
        let body = Layer {
            name: BODY_STEP.into(),
            template: None,
            mesh: registered.surface,
            weights: model.weights,
            colors: registered.colors,
            uvs: model.uvs,
            physics: None,
            fabric: None,
        };
        let vertices = body.mesh.vertex_count();
        let figure = Figure { skeleton: registered.skeleton, layers: vec![body] };
        Ok(Outcome::of(figure).measured("layers", 1.0).measured("vertices", vertices as f64))
    })
}
