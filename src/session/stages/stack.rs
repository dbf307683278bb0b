//! Stack: pushes the garment clear of the layers inside, in the bind pose.

use super::event::{OnProgress, Outcome};
use super::pipeline_stage::{PipelineStage, StepContext};
use super::rig::RigStage;
use crate::body::Figure;
use crate::geometry::TriMesh;
use crate::rig::RiggedGarment;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{StepRecipe, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use crate::stack::{StackParams, stack};
use serde_json::{Value, json};

pub(in crate::session) struct StackStage;

pub(in crate::session) struct Inputs {
    rigged: Kept<RiggedGarment>,
    figure: Kept<Figure>,
    params: StackParams,
}

impl PipelineStage for StackStage {
    const STAGE: Stage = Stage::Stack;
    const VERSION: u32 = 1;
    type Inputs = Inputs;
    type Output = TriMesh;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        let params: StackParams = params_of(context.step, Stage::Stack)?;
        let (rigged, figure) = (context.results.result::<RigStage>()?, context.inner()?.figure()?);
        let values = json!({ "rigged": rigged.hash, "figure": figure.hash, "params": params });
        Ok((Inputs { rigged, figure, params }, values))
    }

    fn run(
        Inputs { rigged, figure, params }: Inputs,
        step: &StepRecipe,
        session: &Session,
        _on_progress: OnProgress,
    ) -> Result<Outcome<TriMesh>, SessionError> {
        let (rigged, figure) = (session.store.load(rigged)?, session.figure(figure)?);
        let (mesh, report) =
            stack(&rigged, &figure, &params).map_err(|e| SessionError::stage(&step.name, Stage::Stack, e))?;
        let left = report.layers.iter().filter(|l| l.inside_after + l.intersecting_pairs_after > 0).map(|l| {
            format!(
                "{} vertices inside and {} triangle pairs crossing '{}' are left",
                l.inside_after, l.intersecting_pairs_after, l.layer
            )
        });
        Ok(Outcome::of(mesh)
            .measured("inside_before", report.layers.iter().map(|l| l.inside_before).sum::<usize>() as f64)
            .measured("inside_after", report.inside_after() as f64)
            .measured("intersecting_pairs", report.intersecting_pairs_after() as f64)
            .measured("mean_move_of_clear_mm", report.mean_move_of_clear * 1e3)
            .measured("max_move_mm", report.max_move * 1e3)
            .found(left))
    }
}
