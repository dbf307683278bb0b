//! Stack: puts the garment on the figure in the bind pose, so that no layer crosses another or itself.

use crate::body::Figure;
use crate::geometry::TriMesh;
use crate::rig::RiggedGarment;
use crate::session::pipeline::memo::at::{Code, Run};
use crate::session::pipeline::memo::event::{OnProgress, Outcome};
use crate::session::pipeline::memo::input::ModelInput;
use crate::session::stage::Stage;
use crate::session::store::{Kept, Store};
use crate::stack::{StackParams, Stacked, stack};
use serde::Serialize;

pub(in crate::session::pipeline) const STACK: Code = Code::new(Stage::Stack, 6);

#[derive(Serialize)]
pub(in crate::session::pipeline) struct Inputs {
    pub rigged: Kept<RiggedGarment>,
    pub figure: Kept<Figure>,
    pub model: ModelInput,
    pub fabric: String,
    pub params: StackParams,
}

/// The result is the surface of each garment, innermost first.
pub(in crate::session::pipeline) fn run(
    Inputs { rigged, figure, model, fabric, params }: Inputs,
    store: &Store,
    _on_progress: OnProgress,
) -> Run<Vec<TriMesh>> {
    let (rigged, figure) = (store.load(rigged)?, model.figure(store, figure)?);
    if rigged.is_absent() {
        let inner = figure.garments().iter().map(|layer| layer.mesh.clone());
        return Ok(Outcome::of(inner.chain([rigged.mesh]).collect()));
    }
    let Stacked { garments, report } = stack(&rigged, Some(&fabric), &figure, &params)?;
    Ok(Outcome::of(garments)
        .measured("inside_before", report.layers.iter().map(|l| l.inside_before).sum::<usize>() as f64)
        .measured("inside_after", report.inside as f64)
        .measured("intersecting_pairs", report.crossing_pairs as f64)
        .measured("mean_move_of_clear_mm", report.mean_move_of_clear * 1e3)
        .measured("max_move_mm", report.max_move * 1e3)
        .measured("rounds", report.rounds as f64))
}
