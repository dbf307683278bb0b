//! Segment: labels the part of the scan that is the new garment, masks included.

use super::labelling::{Evidence, Labelling};
use super::marks::{MasksOfScan, is_something};
use crate::geometry::Adjacency;
use crate::scan::Scan;
use crate::segment::{Marks, Segmentation};
use crate::session::pipeline::memo::at::{Code, Run, RunError};
use crate::session::pipeline::memo::event::{OnProgress, Outcome};
use crate::session::stage::Stage;
use crate::session::store::{Kept, Store};
use serde::Serialize;

pub(in crate::session::pipeline) const SEGMENT: Code = Code::new(Stage::Segment, 5);

#[derive(Serialize)]
pub(in crate::session::pipeline) struct Inputs {
    pub scan: Kept<Scan>,
    pub evidence: Kept<Evidence>,
    #[serde(flatten)]
    pub masks: MasksOfScan,
}

pub(in crate::session::pipeline) fn run(
    Inputs { scan: kept_scan, evidence, masks }: Inputs,
    store: &Store,
    _on_progress: OnProgress,
) -> Run<Segmentation> {
    let scan = store.load_shared(kept_scan)?;
    let labelling = Labelling::load(store, evidence, &masks, kept_scan, &scan)?;
    let adjacency = store.prepared(kept_scan.hash, || Adjacency::prepare(&scan.mesh));
    let marks = masks.marks(store, kept_scan, &scan, |_| true)?;
    let segmentation = labelling.corrected(&scan.mesh, &adjacency, &marks)?;
    if !is_something(&scan, &segmentation.labels)
        && let Some(last) = masks.own().last()
    {
        let unmarked = Marks::none(scan.mesh.vertex_count());
        let before = labelling.corrected(&scan.mesh, &adjacency, &unmarked)?;
        if is_something(&scan, &before.labels) {
            return Err(RunError::NothingLeft(last.file.path().into()));
        }
    }
    let count = segmentation.labels.garment_vertex_count();
    let by_hand = segmentation.by_hand.iter().filter(|&&h| h).count();
    let outcome = Outcome::of(segmentation).measured("garment_vertices", count as f64);
    Ok(if masks.own().is_empty() { outcome } else { outcome.measured("by_hand_vertices", by_hand as f64) })
}
