//! The contact sheet of weights: the skin weights of every layer, the physics weights of every garment.

use crate::body::Layer;
use crate::geometry::PerVertex;
use crate::rig::{PhysicsParams, PhysicsWeights};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{garment_spec, params_of};
use crate::session::results::outputs::{Content, Outputs};
use crate::session::results::posed_step::PosedStep;
use crate::session::stage::Stage;
use crate::view::{LayerPhysics, Sheet, WeightedLayer, contact_sheet, joint_legend, skin_weight_colors};
use std::path::Path;

impl Session {
    /// Draws the weights of each layer in the bind pose, as its step made it, and writes a PNG. Skin weights are colours of
    /// the joints, blended by weight. Physics weights are on a ramp: the field per vertex, and Eq. 9 of Hu 2017 per part.
    ///
    /// **Errors** if not even the body is built, or if `path` cannot be written.
    pub fn write_weights(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SessionError> {
        let steps = self.posed_steps_so_far()?;
        let Some(last) = steps.last() else {
            return self.posed_steps(None).map(drop);
        };
        let layers = steps.iter().map(|posed| self.weighted_layer(posed)).collect::<Result<Vec<_>, _>>()?;
        let mut rows = Vec::new();
        for layer in layers.iter().flatten() {
            rows.push(layer.row().map_err(|e| SessionError::bad_source(path, e))?);
        }
        if let Some(body) = rows.first_mut() {
            body.legend = joint_legend(&last.figure.skeleton);
        }
        let subtitle = match self.recipe.steps.len() - steps.len() {
            0 => "in the bind pose".to_string(),
            missing => format!("in the bind pose; {missing} of {} steps are not built", self.recipe.steps.len()),
        };
        let sheet = Sheet::new(format!("{}: skin weights and physics weights", self.name()), subtitle, rows);
        outputs.write(path, Content::Picture, |out| contact_sheet(&sheet).write_png(out))
    }

    /// The outermost layer of a step, which is the step's own; `None` if it has none.
    fn weighted_layer<'a>(&self, posed: &'a PosedStep) -> Result<Option<WeightedLayer<'a>>, SessionError> {
        let Some(layer) = posed.figure.layers.last().filter(|_| posed.has_layer()) else { return Ok(None) };
        let physics = match &layer.physics {
            Some(per_vertex) => Some(self.layer_physics(posed, layer, per_vertex)?),
            None => None,
        };
        Ok(Some(WeightedLayer { layer, joints: skin_weight_colors(&layer.weights), physics }))
    }

    fn layer_physics(
        &self,
        posed: &PosedStep,
        layer: &Layer,
        per_vertex: &PerVertex<f64>,
    ) -> Result<LayerPhysics, SessionError> {
        let spec = garment_spec::of_step(&posed.step)?;
        let loose = spec.template.loose_part(layer.mesh.points(), posed.figure.body(), &posed.figure.skeleton);
        let measures = self.state.record(&posed.step.name, Stage::Figure).map(|record| &record.measures);
        let measure = |name: &str| measures.and_then(|measures| measures.get(name).copied());
        let weights = PhysicsWeights {
            loose_part: measure("physics_of_loose_part"),
            fitted_part: measure("physics_of_fitted_part"),
            per_vertex: per_vertex.clone(),
        };
        let params: PhysicsParams = params_of(&posed.step, Stage::Figure)?;
        Ok(LayerPhysics { per_part: weights.per_part(&loose), weights, greatest_share: params.greatest_share })
    }
}
