//! Segment: labels the part of the scan that is the new garment, masks included.

use super::event::{OnProgress, Outcome};
use super::evidence::EvidenceStage;
use super::marks;
use super::pipeline_stage::{PipelineStage, StepContext};
use super::scan::ScanStage;
use crate::geometry::Adjacency;
use crate::scan::Scan;
use crate::segment::{Proposal, Segmentation};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::StepRecipe;
use crate::session::stage::Stage;
use crate::session::store::Kept;
use serde_json::{Value, json};

pub(in crate::session) struct SegmentStage;

pub(in crate::session) struct Inputs {
    scan: Kept<Scan>,
    proposal: Kept<Proposal>,
}

impl PipelineStage for SegmentStage {
    const STAGE: Stage = Stage::Segment;
    const VERSION: u32 = 2;
    type Inputs = Inputs;
    type Output = Segmentation;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        let (scan, proposal) = (context.results.result::<ScanStage>()?, context.results.result::<EvidenceStage>()?);
        let masks: Vec<_> = context.step.masks.iter().map(|m| m.hash).collect();
        let values = json!({ "scan": scan.hash, "evidence": proposal.hash, "masks": masks });
        Ok((Inputs { scan, proposal }, values))
    }

    fn run(
        Inputs { scan: kept_scan, proposal }: Inputs,
        step: &StepRecipe,
        session: &Session,
        _on_progress: OnProgress,
    ) -> Result<Outcome<Segmentation>, SessionError> {
        let (scan, proposal) = (session.store.load_shared(kept_scan)?, session.store.load_shared(proposal)?);
        let adjacency = session.store.prepared(kept_scan.hash, || Adjacency::prepare(&scan.mesh));
        let marks = marks::marks_of(session, step, &scan)?;
        let segmentation = proposal
            .corrected(&scan.mesh, &adjacency, &marks)
            .map_err(|e| SessionError::stage(&step.name, Stage::Segment, e))?;
        if let Some(last) = step.masks.last()
            && !marks::is_something(&scan, &segmentation.labels)
            && marks::is_something(&scan, proposal.labels())
        {
            return Err(marks::nothing_left(&session.resolve(&last.file), None, &step.name));
        }
        let count = segmentation.labels.garment_vertex_count();
        let by_hand = segmentation.by_hand.iter().filter(|&&h| h).count();
        let outcome = Outcome::of(segmentation).measured("garment_vertices", count as f64);
        Ok(if step.masks.is_empty() { outcome } else { outcome.measured("by_hand_vertices", by_hand as f64) })
    }
}
