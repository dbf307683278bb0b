//! Rig: the garment's skin weights, and its shape in the bind pose.

use super::cut::CutStage;
use super::event::{OnProgress, Outcome};
use super::pipeline_stage::{PipelineStage, StepContext};
use super::pose::PoseStage;
use crate::body::Figure;
use crate::cut::Garment;
use crate::fit::PoseInside;
use crate::rig::{RigParams, RiggedGarment, rig};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{StepRecipe, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use serde_json::{Value, json};

pub(in crate::session) struct RigStage;

pub(in crate::session) struct Inputs {
    garment: Kept<Garment>,
    figure: Kept<Figure>,
    inside: Kept<PoseInside>,
    params: RigParams,
}

impl PipelineStage for RigStage {
    const STAGE: Stage = Stage::Rig;
    const VERSION: u32 = 3;
    type Inputs = Inputs;
    type Output = RiggedGarment;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        let params: RigParams = params_of(context.step, Stage::Rig)?;
        let (garment, inside) = (context.results.result::<CutStage>()?, context.results.result::<PoseStage>()?);
        let figure = context.inner()?.figure()?;
        let values = json!({ "garment": garment.hash, "figure": figure.hash, "inside": inside.hash, "params": params });
        Ok((Inputs { garment, figure, inside, params }, values))
    }

    fn run(
        Inputs { garment, figure, inside, params }: Inputs,
        step: &StepRecipe,
        session: &Session,
        _on_progress: OnProgress,
    ) -> Result<Outcome<RiggedGarment>, SessionError> {
        let (garment, figure) = (session.store.load(garment)?, session.figure(figure)?);
        let inside = session.store.load(inside)?;
        if garment.is_absent() {
            return Ok(Outcome::of(RiggedGarment::absent()));
        }
        let rigged = rig(&garment.mesh, garment.colors.as_ref(), &figure, &inside, &params)
            .map_err(|e| SessionError::stage(&step.name, Stage::Rig, e))?;
        let report = rigged.report.clone();
        Ok(Outcome::of(rigged)
            .measured("confident_percent", report.confident_share * 100.0)
            .measured("stretch_p99", report.stretch_p99)
            .measured("pruned_max", report.pruned_max))
    }
}
