//! Evidence: what the scan shows of the new garment. It does not depend on masks, so that one costs only what is near it.

use super::event::{OnProgress, Outcome};
use super::hair::KnownHair;
use super::kinds::NewGarments;
use super::labelling::Evidence;
use super::pipeline_stage::{PipelineStage, StepContext};
use super::pose::PoseStage;
use super::posed::surfaces_inside;
use super::scan::ScanStage;
use crate::body::Figure;
use crate::fit::{FittedBody, PoseInside};
use crate::scan::Scan;
use crate::segment::{Inner, Proposal, RefineParams, propose, propose_outfit};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{GarmentSpec, StepRecipe, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use serde_json::{Value, json};

pub(in crate::session) struct EvidenceStage;

pub(in crate::session) struct Inputs {
    scan: Kept<Scan>,
    figure: Kept<Figure>,
    inside: Kept<PoseInside>,
    garments: NewGarments,
    hair: Option<Kept<FittedBody>>,
    params: RefineParams,
}

impl PipelineStage for EvidenceStage {
    const STAGE: Stage = Stage::Evidence;
    const VERSION: u32 = 3;
    type Inputs = Inputs;
    type Output = Evidence;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        let garments = NewGarments::of(&context.walk.session().recipe, context.step)?;
        let params: RefineParams = params_of(context.step, Stage::Segment)?;
        let (scan, inside) = (context.results.result::<ScanStage>()?, context.results.result::<PoseStage>()?);
        let figure = context.before_scan()?.figure()?;
        let values = json!({
            "scan": scan.hash,
            "figure": figure.hash,
            "inside": inside.hash,
            "params": params,
        });
        let mut values = garments.among(values, context.step.outfit.is_some());
        let hair = context.fit_with_hair()?;
        if let Some(fitted) = hair {
            values["hair"] = json!(fitted.hash);
        }
        Ok((Inputs { scan, figure, inside, garments, hair, params }, values))
    }

    fn run(
        Inputs { scan, figure, inside, garments, hair, params }: Inputs,
        step: &StepRecipe,
        session: &Session,
        _on_progress: OnProgress,
    ) -> Result<Outcome<Evidence>, SessionError> {
        let (scan, figure) = (session.store.load(scan)?, session.figure(figure)?);
        let inside = session.store.load(inside)?;
        let failed = |e| SessionError::stage(&step.name, Stage::Segment, e);
        let hair = KnownHair::load(session, hair, &figure)?.map(|hair| hair.placement(&figure));
        if garments.are_hair() && hair.is_none() {
            return Ok(Outcome::of(Evidence::Garment(Proposal::of_nothing(&scan.mesh))));
        }
        let place = |spec: &GarmentSpec| spec.template.place(figure.body(), &figure.skeleton, &spec.extent);
        let placements = garments.0.iter().map(place).collect::<Result<Vec<_>, _>>().map_err(failed)?;
        let surfaces = surfaces_inside(&figure, &inside)?;
        let layers: Vec<Inner> = surfaces
            .iter()
            .zip(&figure.layers)
            .map(|(mesh, layer)| Inner { mesh, colors: layer.colors.as_ref() })
            .collect();
        let evidence = match (placements.as_slice(), &hair, step.outfit.is_some()) {
            (_, Some(hair), _) if garments.are_hair() => {
                Evidence::Garment(propose(&scan, &layers, hair, &params).map_err(failed)?)
            }
            ([only], None, false) => Evidence::Garment(propose(&scan, &layers, only, &params).map_err(failed)?),
            (all, hair, _) => {
                Evidence::Outfit(propose_outfit(&scan, &layers, all, hair.as_ref(), &params).map_err(failed)?)
            }
        };
        Ok(Outcome::of(evidence))
    }
}
