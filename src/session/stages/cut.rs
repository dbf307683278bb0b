//! Cut: cuts the garment out of the scan as its own mesh, with smooth hems.

use super::event::{OnProgress, Outcome};
use super::hair::KnownHair;
use super::pipeline_stage::{PipelineStage, StepContext};
use super::pose::PoseStage;
use super::posed::body_inside;
use super::scan::ScanStage;
use super::segment::SegmentStage;
use crate::body::Figure;
use crate::cut::{BodyBelow, CutError, CutParams, Garment, cut};
use crate::fit::{FittedBody, PoseInside};
use crate::geometry::Adjacency;
use crate::scan::Scan;
use crate::segment::{SegmentError, Segmentation};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{GarmentSpec, StepRecipe, garment_spec, params_of};
use crate::session::stage::Stage;
use crate::session::store::{Kept, Warning};
use serde_json::{Value, json};

pub(in crate::session) struct CutStage;

pub(in crate::session) struct Inputs {
    scan: Kept<Scan>,
    segmentation: Kept<Segmentation>,
    figure: Kept<Figure>,
    inside: Kept<PoseInside>,
    spec: GarmentSpec,
    /// The fit of the body with its hair, if the step cuts that out.
    hair: Option<Kept<FittedBody>>,
    params: CutParams,
}

impl PipelineStage for CutStage {
    const STAGE: Stage = Stage::Cut;
    const VERSION: u32 = 10;
    type Inputs = Inputs;
    type Output = Garment;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        let params: CutParams = params_of(context.step, Stage::Cut)?;
        let spec = garment_spec::of_step(context.step)?;
        let (scan, segmentation) = (context.results.result::<ScanStage>()?, context.results.result::<SegmentStage>()?);
        let inside = context.results.result::<PoseStage>()?;
        let figure = context.inner()?.figure()?;
        let mut values = json!({
            "scan": scan.hash,
            "labels": segmentation.hash,
            "figure": figure.hash,
            "inside": inside.hash,
            "kind": spec.input(),
            "params": params,
        });
        let hair = if spec.template.grows { context.fit_with_hair()? } else { None };
        if let Some(fitted) = hair {
            values["hair"] = json!(fitted.hash);
        }
        Ok((Inputs { scan, segmentation, figure, inside, spec, hair, params }, values))
    }

    fn run(
        Inputs { scan: kept_scan, segmentation, figure, inside, spec, hair, params }: Inputs,
        step: &StepRecipe,
        session: &Session,
        _on_progress: OnProgress,
    ) -> Result<Outcome<Garment>, SessionError> {
        let (scan, segmentation) = (session.store.load_shared(kept_scan)?, session.store.load_shared(segmentation)?);
        let adjacency = session.store.prepared(kept_scan.hash, || Adjacency::prepare(&scan.mesh));
        let (figure, inside) = (session.figure(figure)?, session.store.load(inside)?);
        let body = body_inside(&figure, &inside)?;
        let covered = match KnownHair::load(session, hair, &figure)? {
            Some(hair) => hair.0,
            None => (spec.template.prior(figure.body(), &figure.skeleton, &spec.extent))
                .map_err(|e| SessionError::stage(&step.name, Stage::Segment, e))?,
        };
        let below = BodyBelow { mesh: &body, covered: &covered };
        let expected_loops = spec.template.expected_loops();
        let garment = match cut(&scan, &adjacency, &segmentation, &below, expected_loops, &params) {
            Err(CutError::NothingLabelled { .. }) if spec.template.grows && step.masks.is_empty() => {
                return Ok(Outcome::of(Garment::absent()));
            }
            // The scan shows other garments, too: they are what it was given for.
            Err(CutError::NothingLabelled { .. }) if step.outfit.is_some() => {
                let absent = SegmentError::NotInOutfit { garment: step.name.clone() };
                let warning = Warning::new(absent.to_string(), absent.hint().unwrap_or_default());
                return Ok(Outcome::of(Garment::absent()).warned([warning]));
            }
            found => found.map_err(|e| SessionError::stage(&step.name, Stage::Cut, e))?,
        };
        let (vertices, hems) = (garment.mesh.vertex_count(), garment.hem_loops.len());
        let findings = garment.findings.clone();
        Ok(Outcome::of(garment)
            .measured("vertices", vertices as f64)
            .measured("hem_loops", hems as f64)
            .found(findings))
    }
}
