//! Rig: the garment's skin weights, and its shape in the bind pose.

use super::dressed::Dressed;
use super::walk::{Outcome, Walk};
use crate::cut::Garment;
use crate::fit::PoseInside;
use crate::rig::{RigParams, RiggedGarment, rig as rig_garment};
use crate::session::error::SessionError;
use crate::session::recipe::{StepRecipe, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use serde_json::json;

pub(in crate::session) fn rig(
    walk: &mut Walk,
    step: &StepRecipe,
    garment: Kept<Garment>,
    inner: &Dressed,
    inside: Kept<PoseInside>,
) -> Result<Kept<RiggedGarment>, SessionError> {
    let params: RigParams = params_of(step, Stage::Rig)?;
    let inputs = json!({
        "garment": garment.hash, "figure": inner.figure.hash, "inside": inside.hash, "params": params
    });
    walk.stage(&step.name, Stage::Rig, inputs, |session, _tell| {
        let (garment, figure) = (session.store.load(garment)?, session.figure(inner.figure)?);
        let inside = session.store.load(inside)?;
        let rigged = rig_garment(&garment.mesh, garment.colors.as_ref(), &figure, &inside, &params)
            .map_err(|e| SessionError::stage(&step.name, Stage::Rig, e))?;
        let report = rigged.report.clone();
        Ok(Outcome::of(rigged)
            .measured("trusted_percent", report.trusted_share * 100.0)
            .measured("stretch_p99", report.stretch_p99)
            .measured("pruned_max", report.pruned_max))
    })
}
