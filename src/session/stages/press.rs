//! Press: the inner garments, pressed by the new one in this step's scan.

use super::cut::CutStage;
use super::event::{OnProgress, Outcome};
use super::pipeline_stage::{PipelineStage, StepContext};
use super::pose::PoseStage;
use super::posed::surfaces_inside;
use crate::body::Figure;
use crate::cut::Garment;
use crate::fit::PoseInside;
use crate::geometry::TriMesh;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{StepRecipe, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use crate::stack::{PressParams, press};
use serde_json::{Value, json};

pub(in crate::session) struct PressStage;

pub(in crate::session) struct Inputs {
    garment: Kept<Garment>,
    figure: Kept<Figure>,
    inside: Kept<PoseInside>,
    params: PressParams,
}

/// The surface of each garment in the pose of the step, innermost first, in the frame of the scan.
pub(in crate::session) type PosedGarments = Vec<TriMesh>;

impl PipelineStage for PressStage {
    const STAGE: Stage = Stage::Press;
    const VERSION: u32 = 3;
    type Inputs = Inputs;
    type Output = PosedGarments;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        let params: PressParams = params_of(context.step, Stage::Press)?;
        let (garment, inside) = (context.results.result::<CutStage>()?, context.results.result::<PoseStage>()?);
        let figure = context.results.figure()?;
        let values = json!({ "garment": garment.hash, "figure": figure.hash, "inside": inside.hash, "params": params });
        Ok((Inputs { garment, figure, inside, params }, values))
    }

    fn run(
        Inputs { garment, figure, inside, params }: Inputs,
        step: &StepRecipe,
        session: &Session,
        _on_progress: OnProgress,
    ) -> Result<Outcome<PosedGarments>, SessionError> {
        let (figure, inside) = (session.figure(figure)?, session.store.load(inside)?);
        let is_hair = step.is_hair();
        let mut surfaces = surfaces_inside(&figure, &inside)?;
        let garment = session.store.load(garment)?;
        if let Some(outermost) = surfaces.last_mut().filter(|_| !garment.is_absent()) {
            *outermost = garment.mesh;
        }
        if is_hair {
            // The bare scan shows nothing that could press the garments.
            return Ok(Outcome::of(surfaces.split_off(1)));
        }
        let (garments, reports) =
            press(&figure, &surfaces, &params).map_err(|e| SessionError::stage(&step.name, Stage::Press, e))?;
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
}
