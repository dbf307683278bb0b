//! Press: the inner garments, pressed by the new one in this step's scan.

use super::posed::surfaces_inside;
use crate::body::Figure;
use crate::cut::Garment;
use crate::fit::PoseInside;
use crate::geometry::TriMesh;
use crate::session::pipeline::memo::at::{Code, Run};
use crate::session::pipeline::memo::event::{OnProgress, Outcome};
use crate::session::pipeline::memo::input::ModelInput;
use crate::session::stage::Stage;
use crate::session::store::{Kept, Store};
use crate::stack::{PressParams, press};
use serde::Serialize;

pub(in crate::session::pipeline) const PRESS: Code = Code::new(Stage::Press, 3);

#[derive(Serialize)]
pub(in crate::session::pipeline) struct Inputs {
    pub garment: Kept<Garment>,
    /// The figure with the garment.
    pub dressed: Kept<Figure>,
    pub inside: Kept<PoseInside>,
    pub model: ModelInput,
    /// The bare scan shows nothing that hair could press.
    pub is_hair: bool,
    pub params: PressParams,
}

/// The surface of each garment in the pose of the step, innermost first, in the frame of the scan.
pub(in crate::session) type PosedGarments = Vec<TriMesh>;

pub(in crate::session::pipeline) fn run(
    Inputs { garment, dressed, inside, model, is_hair, params }: Inputs,
    store: &Store,
    _on_progress: OnProgress,
) -> Run<PosedGarments> {
    let (figure, inside) = (model.figure(store, dressed)?, store.load(inside)?);
    let mut surfaces = surfaces_inside(&figure, &inside)?;
    let garment = store.load(garment)?;
    if let Some(outermost) = surfaces.last_mut().filter(|_| !garment.is_absent()) {
        *outermost = garment.mesh;
    }
    if is_hair {
        return Ok(Outcome::of(surfaces.split_off(1)));
    }
    let (garments, reports) = press(&figure, &surfaces, &params)?;
    let most = reports.iter().map(|r| r.max_move).fold(0.0, f64::max);
    let left = reports.iter().filter(|r| r.outside_after > 0).map(|r| {
        format!("{} vertices of '{}' do not fit between the layers over and under it", r.outside_after, r.layer)
    });
    Ok(Outcome::of(garments)
        .measured("outside_before", reports.iter().map(|r| r.outside_before).sum::<usize>() as f64)
        .measured("outside_after", reports.iter().map(|r| r.outside_after).sum::<usize>() as f64)
        .measured("max_move_mm", most * 1e3)
        .found(left))
}
