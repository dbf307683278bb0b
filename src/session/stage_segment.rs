//! Segment: which of the scan is the new garment.

use super::flow::Dressed;
use super::recipe::StepRecipe;
use super::state::Stage;
use super::store::Kept;
use super::walk::{Outcome, Walk};
use super::{SessionError, garment_kind, worn};
use crate::fit::PoseInside;
use crate::scan::Scan;
use crate::segment::{Labels, transfer};
use serde_json::json;

pub(super) fn segment(
    walk: &mut Walk,
    step: &StepRecipe,
    scan: Kept<Scan>,
    inner: &Dressed,
    inside: Kept<PoseInside>,
) -> Result<Kept<Labels>, SessionError> {
    let kind = garment_kind::of_step(step)?;
    let masks: Vec<_> = step.masks.iter().map(|m| m.hash).collect();
    let inputs = json!({
        "scan": scan.hash,
        "figure": inner.figure.hash,
        "inside": inside.hash,
        "kind": kind.input(),
        "masks": masks,
    });
    walk.stage(&step.name, Stage::Segment, inputs, |session, _tell| {
        let (scan, figure) = (session.store.load(scan)?, session.store.load(inner.figure)?);
        let inside = session.store.load(inside)?;
        let prior = kind.template.prior(figure.body(), &figure.skeleton, &kind.extent);
        let posed_body = worn::body_inside(&figure, &inside);
        let labels = transfer(&scan, &posed_body, &prior);
        let count = labels.garment_vertex_count();
        Ok(Outcome::of(labels).measured("garment_vertices", count as f64))
    })
}
