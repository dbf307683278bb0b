//! Evidence: what the scan shows of the new garment. Masks do not touch it, so that one costs only what is near it.

use super::dressed::{Dressed, surfaces_inside};
use super::walk::{Outcome, Walk};
use crate::fit::PoseInside;
use crate::scan::Scan;
use crate::segment::{Inner, Proposal, RefineParams, propose};
use crate::session::error::SessionError;
use crate::session::recipe::{StepRecipe, garment_kind, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use serde_json::json;

pub(in crate::session) fn evidence(
    walk: &mut Walk,
    step: &StepRecipe,
    scan: Kept<Scan>,
    inner: &Dressed,
    inside: Kept<PoseInside>,
) -> Result<Kept<Proposal>, SessionError> {
    let kind = garment_kind::of_step(step)?;
    let params: RefineParams = params_of(step, Stage::Segment)?;
    let inputs = json!({
        "scan": scan.hash,
        "figure": inner.figure.hash,
        "inside": inside.hash,
        "kind": kind.input(),
        "params": params,
    });
    walk.stage(&step.name, Stage::Evidence, inputs, |session, _tell| {
        let (scan, figure) = (session.store.load(scan)?, session.figure(inner.figure)?);
        let inside = session.store.load(inside)?;
        let placement = kind.template.place(figure.body(), &figure.skeleton, &kind.extent);
        let surfaces = surfaces_inside(&figure, &inside);
        let layers: Vec<Inner> = surfaces
            .iter()
            .zip(&figure.layers)
            .map(|(mesh, layer)| Inner { mesh, colors: layer.colors.as_ref() })
            .collect();
        Ok(Outcome::of(propose(&scan, &layers, &placement, &params)))
    })
}
