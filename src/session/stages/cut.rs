//! Cut: the garment as a mesh of its own, with its hems.

use super::walk::{Outcome, Walk};
use crate::cut::{CutParams, Garment, cut as cut_out};
use crate::geometry::Adjacency;
use crate::scan::Scan;
use crate::segment::Segmentation;
use crate::session::error::SessionError;
use crate::session::recipe::{StepRecipe, garment_kind, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use serde_json::json;

pub(in crate::session) fn cut(
    walk: &mut Walk,
    step: &StepRecipe,
    scan: Kept<Scan>,
    segmentation: Kept<Segmentation>,
) -> Result<Kept<Garment>, SessionError> {
    let params: CutParams = params_of(step, Stage::Cut)?;
    let loops = garment_kind::of_step(step)?.template.expected_loops();
    let inputs = json!({
        "scan": scan.hash, "labels": segmentation.hash, "loops": [loops.start(), loops.end()], "params": params
    });
    walk.stage(&step.name, Stage::Cut, inputs, |session, _tell| {
        let adjacency_of = scan.hash;
        let (scan, segmentation) = (session.store.load_shared(scan)?, session.store.load_shared(segmentation)?);
        let adjacency = session.store.prepared(adjacency_of, || Adjacency::prepare(&scan.mesh));
        let garment = cut_out(&scan, &adjacency, &segmentation, loops, &params)
            .map_err(|e| SessionError::stage(&step.name, Stage::Cut, e))?;
        let (vertices, hems) = (garment.mesh.vertex_count(), garment.hem_loops.len());
        let findings = garment.findings.clone();
        Ok(Outcome::of(garment)
            .measured("vertices", vertices as f64)
            .measured("hem_loops", hems as f64)
            .found(findings))
    })
}
