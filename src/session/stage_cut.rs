//! Cut: the garment as a mesh of its own, with its hems.

use super::parameters::params_of;
use super::recipe::StepRecipe;
use super::state::Stage;
use super::store::Kept;
use super::walk::{Outcome, Walk};
use super::{SessionError, garment_kind};
use crate::cut::{CutParams, Garment, cut as cut_out};
use crate::scan::Scan;
use crate::segment::Labels;
use serde_json::json;

pub(super) fn cut(
    walk: &mut Walk,
    step: &StepRecipe,
    scan: Kept<Scan>,
    labels: Kept<Labels>,
) -> Result<Kept<Garment>, SessionError> {
    let params: CutParams = params_of(step, Stage::Cut)?;
    let loops = garment_kind::of_step(step)?.template.expected_loops();
    let inputs = json!({
        "scan": scan.hash, "labels": labels.hash, "loops": [loops.start(), loops.end()], "params": params
    });
    walk.stage(&step.name, Stage::Cut, inputs, |session, _tell| {
        let (scan, labels) = (session.store.load(scan)?, session.store.load(labels)?);
        let garment =
            cut_out(&scan, &labels, loops, &params).map_err(|e| SessionError::stage(&step.name, Stage::Cut, e))?;
        let (vertices, hems) = (garment.mesh.vertex_count(), garment.hem_loops.len());
        let findings = garment.findings.clone();
        Ok(Outcome::of(garment)
            .measured("vertices", vertices as f64)
            .measured("hem_loops", hems as f64)
            .found(findings))
    })
}
