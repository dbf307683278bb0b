//! Cut: cuts the garment out of the scan as its own mesh, with smooth hems.

use super::event::{OnProgress, Outcome};
use super::pipeline_stage::{PipelineStage, StepContext};
use super::scan::ScanStage;
use super::segment::SegmentStage;
use crate::cut::{CutParams, Garment, cut};
use crate::geometry::Adjacency;
use crate::scan::Scan;
use crate::segment::Segmentation;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{StepRecipe, garment_spec, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use serde_json::{Value, json};
use std::ops::RangeInclusive;

pub(in crate::session) struct CutStage;

pub(in crate::session) struct Inputs {
    scan: Kept<Scan>,
    segmentation: Kept<Segmentation>,
    expected_loops: RangeInclusive<usize>,
    params: CutParams,
}

impl PipelineStage for CutStage {
    const STAGE: Stage = Stage::Cut;
    const VERSION: u32 = 5;
    type Inputs = Inputs;
    type Output = Garment;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        let params: CutParams = params_of(context.step, Stage::Cut)?;
        let expected_loops = garment_spec::of_step(context.step)?.template.expected_loops();
        let (scan, segmentation) = (context.results.result::<ScanStage>()?, context.results.result::<SegmentStage>()?);
        let values = json!({
            "scan": scan.hash,
            "labels": segmentation.hash,
            "loops": [expected_loops.start(), expected_loops.end()],
            "params": params,
        });
        Ok((Inputs { scan, segmentation, expected_loops, params }, values))
    }

    fn run(
        Inputs { scan: kept_scan, segmentation, expected_loops, params }: Inputs,
        step: &StepRecipe,
        session: &Session,
        _on_progress: OnProgress,
    ) -> Result<Outcome<Garment>, SessionError> {
        let (scan, segmentation) = (session.store.load_shared(kept_scan)?, session.store.load_shared(segmentation)?);
        let adjacency = session.store.prepared(kept_scan.hash, || Adjacency::prepare(&scan.mesh));
        let garment = cut(&scan, &adjacency, &segmentation, expected_loops, &params)
            .map_err(|e| SessionError::stage(&step.name, Stage::Cut, e))?;
        let (vertices, hems) = (garment.mesh.vertex_count(), garment.hem_loops.len());
        let findings = garment.findings.clone();
        Ok(Outcome::of(garment)
            .measured("vertices", vertices as f64)
            .measured("hem_loops", hems as f64)
            .found(findings))
    }
}
