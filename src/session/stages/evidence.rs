//! Evidence: what the scan shows of the new garment. It does not depend on masks, so that one costs only what is near it.

use super::event::{OnProgress, Outcome};
use super::pipeline_stage::{PipelineStage, StepContext};
use super::pose::PoseStage;
use super::posed::surfaces_inside;
use super::scan::ScanStage;
use crate::body::Figure;
use crate::fit::PoseInside;
use crate::scan::Scan;
use crate::segment::{Inner, Proposal, RefineParams, propose};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{GarmentSpec, StepRecipe, garment_spec, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use serde_json::{Value, json};

pub(in crate::session) struct EvidenceStage;

pub(in crate::session) struct Inputs {
    scan: Kept<Scan>,
    figure: Kept<Figure>,
    inside: Kept<PoseInside>,
    spec: GarmentSpec,
    params: RefineParams,
}

impl PipelineStage for EvidenceStage {
    const STAGE: Stage = Stage::Evidence;
    const VERSION: u32 = 1;
    type Inputs = Inputs;
    type Output = Proposal;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        let spec = garment_spec::of_step(context.step)?;
        let params: RefineParams = params_of(context.step, Stage::Segment)?;
        let (scan, inside) = (context.results.result::<ScanStage>()?, context.results.result::<PoseStage>()?);
        let figure = context.inner()?.figure()?;
        let values = json!({
            "scan": scan.hash,
            "figure": figure.hash,
            "inside": inside.hash,
            "kind": spec.input(),
            "params": params,
        });
        Ok((Inputs { scan, figure, inside, spec, params }, values))
    }

    fn run(
        Inputs { scan, figure, inside, spec, params }: Inputs,
        step: &StepRecipe,
        session: &Session,
        _on_progress: OnProgress,
    ) -> Result<Outcome<Proposal>, SessionError> {
        let (scan, figure) = (session.store.load(scan)?, session.figure(figure)?);
        let inside = session.store.load(inside)?;
        let placement = (spec.template.place(figure.body(), &figure.skeleton, &spec.extent))
            .map_err(|e| SessionError::stage(&step.name, Stage::Segment, e))?;
        let surfaces = surfaces_inside(&figure, &inside)?;
        let layers: Vec<Inner> = surfaces
            .iter()
            .zip(&figure.layers)
            .map(|(mesh, layer)| Inner { mesh, colors: layer.colors.as_ref() })
            .collect();
        let proposal = propose(&scan, &layers, &placement, &params)
            .map_err(|e| SessionError::stage(&step.name, Stage::Segment, e))?;
        Ok(Outcome::of(proposal))
    }
}
