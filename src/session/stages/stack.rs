//! Stack: puts the garment on the figure in the bind pose, so that no layer crosses another or itself.

use super::event::{OnProgress, Outcome};
use super::pipeline_stage::{PipelineStage, StepContext};
use super::rig::RigStage;
use crate::body::Figure;
use crate::geometry::TriMesh;
use crate::rig::RiggedGarment;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{StepRecipe, garment_spec, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use crate::stack::{StackParams, Stacked, stack};
use serde_json::{Value, json};

pub(in crate::session) struct StackStage;

pub(in crate::session) struct Inputs {
    rigged: Kept<RiggedGarment>,
    figure: Kept<Figure>,
    fabric: String,
    params: StackParams,
}

impl PipelineStage for StackStage {
    const STAGE: Stage = Stage::Stack;
    const VERSION: u32 = 5;
    type Inputs = Inputs;
    type Output = Vec<TriMesh>;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        let params: StackParams = params_of(context.step, Stage::Stack)?;
        let (rigged, figure) = (context.results.result::<RigStage>()?, context.inner()?.figure()?);
        let fabric = garment_spec::of_step(context.step)?.template.fabric;
        let values = json!({ "rigged": rigged.hash, "figure": figure.hash, "fabric": fabric, "params": params });
        Ok((Inputs { rigged, figure, fabric, params }, values))
    }

    fn run(
        Inputs { rigged, figure, fabric, params }: Inputs,
        step: &StepRecipe,
        session: &Session,
        _on_progress: OnProgress,
    ) -> Result<Outcome<Vec<TriMesh>>, SessionError> {
        let (rigged, figure) = (session.store.load(rigged)?, session.figure(figure)?);
        if rigged.is_absent() {
            let inner = figure.garments().iter().map(|layer| layer.mesh.clone());
            return Ok(Outcome::of(inner.chain([rigged.mesh]).collect()));
        }
        let Stacked { garments, report } = stack(&rigged, Some(&fabric), &figure, &params)
            .map_err(|e| SessionError::stage(&step.name, Stage::Stack, e))?;
        Ok(Outcome::of(garments)
            .measured("inside_before", report.layers.iter().map(|l| l.inside_before).sum::<usize>() as f64)
            .measured("inside_after", report.inside as f64)
            .measured("intersecting_pairs", report.crossing_pairs as f64)
            .measured("mean_move_of_clear_mm", report.mean_move_of_clear * 1e3)
            .measured("max_move_mm", report.max_move * 1e3)
            .measured("rounds", report.rounds as f64))
    }
}
