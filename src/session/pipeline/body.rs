//! The step of the bare body, as named calls.

use super::check::{self, CHECK};
use super::figure::{self, FIGURE};
use super::fit::{self, FIT};
use super::garment::scan_of;
use super::garment_scans::garment_scans;
use super::hair::HAIR_AREA;
use super::input::ModelInput;
use super::register::{self, REGISTER};
use super::steps::{OfStep, StepResults};
use super::walk::Walk;
use crate::session::error::SessionError;
use crate::session::recipe::{BodySurface, Recipe, StepRecipe, params_of};
use crate::session::stage::Stage;

pub(super) fn body(walk: &mut Walk, recipe: &Recipe, step: &StepRecipe) -> Result<StepResults, SessionError> {
    let model = ModelInput::of(walk.session());
    let scan = scan_of(walk, step)?;
    let others = garment_scans(walk, recipe, step)?;
    let at = &mut walk.at(&step.name);

    let params = params_of(step, Stage::Fit)?;
    let inputs = fit::Inputs { scan, model: model.clone(), others: others.clone(), params };
    let fit = at.run(FIT, inputs, fit::run)?;
    let fitted = fit.kept;

    let params = params_of(step, Stage::Register)?;
    let inputs = register::Inputs { scan, fitted, model: model.clone(), others, params };
    let registered = at.run(REGISTER, inputs, register::run)?.kept;

    let surface = (step.surface == Some(BodySurface::Scan)).then_some(scan);
    let inputs = figure::BodyInputs { registered, model: model.clone(), surface };
    let figure = at.run(FIGURE, inputs, figure::body_alone)?.kept;

    at.run(CHECK, check::BodyInputs { scan, fitted, registered, model }, check::body)?;
    let has_hair = fit.measures.contains_key(HAIR_AREA);
    Ok(StepResults { scan, figure, of: OfStep::Body { fitted, registered, has_hair } })
}
