//! Press: what is worn below, as the garment over it pressed it in this step's scan.

use super::dressed::{Worn, surfaces_inside};
use super::walk::{Outcome, Walk};
use crate::body::Figure;
use crate::cut::Garment;
use crate::fit::PoseInside;
use crate::session::error::SessionError;
use crate::session::recipe::{StepRecipe, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use crate::stack::{PressParams, press as press_layers};
use serde_json::json;

pub(in crate::session) fn press(
    walk: &mut Walk,
    step: &StepRecipe,
    garment: Kept<Garment>,
    figure: Kept<Figure>,
    inside: Kept<PoseInside>,
) -> Result<Kept<Worn>, SessionError> {
    let params: PressParams = params_of(step, Stage::Press)?;
    let inputs = json!({ "garment": garment.hash, "figure": figure.hash, "inside": inside.hash, "params": params });
    walk.stage(&step.name, Stage::Press, inputs, |session, _tell| {
        let (figure, inside) = (session.figure(figure)?, session.store.load(inside)?);
        let mut surfaces = surfaces_inside(&figure, &inside);
        if let Some(outermost) = surfaces.last_mut() {
            *outermost = session.store.load(garment)?.mesh;
        }
        let (worn, reports) =
            press_layers(&figure, &surfaces, &params).map_err(|e| SessionError::stage(&step.name, Stage::Press, e))?;
        let most = reports.iter().map(|r| r.max_move).fold(0.0, f64::max);
        let left = reports.iter().filter(|r| r.outside_after > 0).map(|r| {
            format!("{} vertices of '{}' find no room between what is worn over and under it", r.outside_after, r.layer)
        });
        Ok(Outcome::of(worn)
            .measured("outside_before", reports.iter().map(|r| r.outside_before).sum::<usize>() as f64)
            .measured("outside_after", reports.iter().map(|r| r.outside_after).sum::<usize>() as f64)
            .measured("max_move_mm", most * 1e3)
            .found(left))
    })
}
