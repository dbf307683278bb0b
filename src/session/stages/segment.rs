//! Segment: which of the scan is the new garment, masks included.

use super::marks;
use super::walk::{Outcome, Walk};
use crate::geometry::Adjacency;
use crate::scan::Scan;
use crate::segment::{Proposal, Segmentation};
use crate::session::error::SessionError;
use crate::session::recipe::StepRecipe;
use crate::session::stage::Stage;
use crate::session::store::Kept;
use serde_json::json;

pub(in crate::session) fn segment(
    walk: &mut Walk,
    step: &StepRecipe,
    scan: Kept<Scan>,
    proposal: Kept<Proposal>,
) -> Result<Kept<Segmentation>, SessionError> {
    let mask_files: Vec<_> = step.masks.iter().map(|m| m.hash).collect();
    let inputs = json!({ "scan": scan.hash, "evidence": proposal.hash, "masks": mask_files });
    walk.stage(&step.name, Stage::Segment, inputs, |session, _tell| {
        let adjacency_of = scan.hash;
        let (scan, proposal) = (session.store.load_shared(scan)?, session.store.load_shared(proposal)?);
        let adjacency = session.store.prepared(adjacency_of, || Adjacency::prepare(&scan.mesh));
        let marks = marks::marks_of(session, step, &scan)?;
        let segmentation = proposal.corrected(&scan.mesh, &adjacency, &marks);
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
    })
}
