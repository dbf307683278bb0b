//! Segment: labels the part of the scan that is the new garment, masks included.

use super::event::{OnProgress, Outcome};
use super::evidence::EvidenceStage;
use super::labelling::Labelling;
use super::marks;
use super::pipeline_stage::{PipelineStage, StepContext};
use super::scan::ScanStage;
use crate::geometry::Adjacency;
use crate::scan::Scan;
use crate::segment::{Marks, Segmentation};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::StepRecipe;
use crate::session::stage::Stage;
use crate::session::store::{ContentHash, Kept};
use serde_json::{Value, json};

pub(in crate::session) struct SegmentStage;

pub(in crate::session) struct Inputs {
    scan: Kept<Scan>,
    evidence: ContentHash,
}

impl PipelineStage for SegmentStage {
    const STAGE: Stage = Stage::Segment;
    const VERSION: u32 = 5;
    type Inputs = Inputs;
    type Output = Segmentation;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        let scan = context.results.result::<ScanStage>()?;
        let evidence = context.results.result::<EvidenceStage>()?.hash;
        let masks_of = |step: &StepRecipe| json!(step.masks.iter().map(|m| m.hash).collect::<Vec<_>>());
        let mut values = json!({ "scan": scan.hash, "evidence": evidence, "masks": masks_of(context.step) });
        if context.step.outfit.is_some() {
            // A mask of one garment takes from the others.
            let outfit = context.walk.session().recipe.outfit_of(context.step);
            values["masks"] = outfit.iter().map(masks_of).collect();
            values["place"] = json!(outfit.iter().position(|of| of.name == context.step.name));
        }
        Ok((Inputs { scan, evidence }, values))
    }

    fn run(
        Inputs { scan: kept_scan, evidence }: Inputs,
        step: &StepRecipe,
        session: &Session,
        _on_progress: OnProgress,
    ) -> Result<Outcome<Segmentation>, SessionError> {
        let scan = session.store.load_shared(kept_scan)?;
        let labelling = Labelling::load(session, step, evidence, &scan)?;
        let adjacency = session.store.prepared(kept_scan.hash, || Adjacency::prepare(&scan.mesh));
        let marks = marks::marks_of(session, step, &scan)?;
        let failed = |e| SessionError::stage(&step.name, Stage::Segment, e);
        let segmentation = labelling.corrected(&scan.mesh, &adjacency, &marks).map_err(failed)?;
        if !marks::is_something(&scan, &segmentation.labels) {
            let unmarked = Marks::none(scan.mesh.vertex_count());
            let before = labelling.corrected(&scan.mesh, &adjacency, &unmarked).map_err(failed)?;
            match step.masks.last() {
                Some(last) if marks::is_something(&scan, &before.labels) => {
                    return Err(marks::nothing_left(&session.resolve(&last.file), None, &step.name));
                }
                _ => {}
            }
        }
        let count = segmentation.labels.garment_vertex_count();
        let by_hand = segmentation.by_hand.iter().filter(|&&h| h).count();
        let outcome = Outcome::of(segmentation).measured("garment_vertices", count as f64);
        Ok(if step.masks.is_empty() { outcome } else { outcome.measured("by_hand_vertices", by_hand as f64) })
    }
}
