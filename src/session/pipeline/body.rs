//! The step of the bare body, as named calls.

use super::memo::input::ModelInput;
use super::memo::walk::Walk;
use super::results::{OfStep, StepResults};
use super::stages::check::{self, CHECK};
use super::stages::figure::{self, FIGURE};
use super::stages::fit::{self, FIT};
use super::stages::later_scans::later_scans;
use super::stages::register::{self, REGISTER};
use super::stages::scan::{self, SCAN};
use super::stages::step_scan::begin_scan;
use crate::check::HAIR_AREA;
use crate::session::error::SessionError;
use crate::session::recipe::{BODY_STEP, BodyStep, BodySurface, Recipe, StepRecipe};

pub(super) fn body(
    walk: &mut Walk,
    recipe: &Recipe,
    step: BodyStep,
    next: Option<&StepRecipe>,
) -> Result<StepResults, SessionError> {
    let model = ModelInput::of(walk.session());
    let inputs = scan::Inputs::of(walk.session(), step.reading.clone());
    let scan = walk.at(BODY_STEP).run(SCAN, inputs, scan::run)?.kept;
    let others = later_scans(walk, recipe, &step)?;
    let at = &mut walk.at(BODY_STEP);

    let is_estimated = step.estimate.is_some();
    let inputs =
        fit::Inputs { scan, model: model.clone(), others: others.clone(), estimate: step.estimate, params: step.fit };
    let fit = at.run(FIT, inputs, fit::run)?;
    let fitted = fit.kept;
    begin_scan(walk, next);
    let at = &mut walk.at(BODY_STEP);

    let inputs = register::Inputs { scan, fitted, model: model.clone(), others, is_estimated, params: step.register };
    let registered = at.run(REGISTER, inputs, register::run)?.kept;

    let surface = (step.surface == BodySurface::Scan).then_some(scan);
    let inputs = figure::BodyInputs { registered, model: model.clone(), surface };
    let figure = at.run(FIGURE, inputs, figure::body_alone)?.kept;

    at.run(CHECK, check::BodyInputs { scan, fitted, registered, model, is_estimated }, check::body)?;
    let has_hair = fit.measures.contains_key(HAIR_AREA);
    Ok(StepResults { scan, figure, of: OfStep::Body { fitted, registered, has_hair }, trim: None, failed: false })
}
