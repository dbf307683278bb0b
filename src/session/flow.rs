//! The way of the data through a session: the body, then each garment on the figure dressed so far.

use super::recipe::{BODY_STEP, StepRecipe};
use super::stage_fit::fit;
use super::stage_scan::scan;
use super::store::Kept;
use super::walk::Walk;
use super::SessionError;
use crate::fit::FittedBody;
use crate::scan::Scan;

/// What a step came to.
pub(super) struct BuiltStep {
    pub name: String,
    pub scan: Kept<Scan>,
    pub fitted: Kept<FittedBody>,
}

/// Walks through all steps, or up to the one named.
pub(super) fn steps(walk: &mut Walk, last: Option<&str>) -> Result<Vec<BuiltStep>, SessionError> {
    let recipe = walk.session().recipe.clone();
    let mut built: Vec<BuiltStep> = Vec::new();
    for step in &recipe.steps {
        built.push(if step.name == BODY_STEP { body(walk, step)? } else { break });
        if last == Some(step.name.as_str()) {
            break;
        }
    }
    Ok(built)
}

fn body(walk: &mut Walk, step: &StepRecipe) -> Result<BuiltStep, SessionError> {
    let scan = scan(walk, step)?;
    let fitted = fit(walk, step, scan)?;
    Ok(BuiltStep { name: step.name.clone(), scan, fitted })
}
