//! Rig: the garment's skin weights, and its shape in the bind pose.

use crate::body::Figure;
use crate::cut::Garment;
use crate::fit::PoseInside;
use crate::rig::{RigParams, RiggedGarment, rig};
use crate::session::pipeline::memo::at::{Code, Run};
use crate::session::pipeline::memo::event::{OnProgress, Outcome};
use crate::session::pipeline::memo::input::ModelInput;
use crate::session::stage::Stage;
use crate::session::store::{Kept, Store};
use serde::Serialize;

pub(in crate::session::pipeline) const RIG: Code = Code::new(Stage::Rig, 4);

#[derive(Serialize)]
pub(in crate::session::pipeline) struct Inputs {
    pub garment: Kept<Garment>,
    pub figure: Kept<Figure>,
    pub inside: Kept<PoseInside>,
    pub model: ModelInput,
    pub params: RigParams,
}

pub(in crate::session::pipeline) fn run(
    Inputs { garment, figure, inside, model, params }: Inputs,
    store: &Store,
    _on_progress: OnProgress,
) -> Run<RiggedGarment> {
    let garment = store.load(garment)?;
    if garment.is_absent() {
        return Ok(Outcome::of(RiggedGarment::absent()));
    }
    let (figure, inside) = (model.figure(store, figure)?, store.load(inside)?);
    let rigged = rig(&garment.mesh, garment.colors.as_ref(), &figure, &inside, &params)?;
    let report = rigged.report.clone();
    Ok(Outcome::of(rigged)
        .measured("confident_percent", report.confident_share * 100.0)
        .measured("stretch_p99", report.stretch_p99)
        .measured("pruned_max", report.pruned_max))
}
