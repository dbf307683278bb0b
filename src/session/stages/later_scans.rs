//! The scans of later steps, for a body whose shape is fitted to all scans of the session.

use super::kinds::{NewGarments, looser};
use super::pipeline_stage::{LaterScan, StepContext};
use super::scan::ScanStage;
use crate::body::Figure;
use crate::fit::{Cover, NakedParams, ShapeFrom};
use crate::geometry::PerVertex;
use crate::session::error::SessionError;
use crate::session::recipe::{StepRecipe, params_of};
use crate::session::stage::Stage;
use serde_json::{Value, json};
use std::rc::Rc;

/// The scans of all later steps if the body's step uses them; otherwise none.
pub(super) fn later_scans(context: &mut StepContext) -> Result<Rc<[LaterScan]>, SessionError> {
    if let Some(known) = &context.later_scans {
        return Ok(known.clone());
    }
    let found: Rc<[LaterScan]> = match params_of::<NakedParams>(context.step, Stage::Fit)?.shape_from {
        ShapeFrom::Naked => Rc::new([]),
        _ => garments_scanned(context)?.into(),
    };
    context.later_scans = Some(found.clone());
    Ok(found)
}

fn garments_scanned(context: &mut StepContext) -> Result<Vec<LaterScan>, SessionError> {
    let recipe = context.walk.session().recipe.clone();
    // The garments of an outfit have one scan.
    let is_bare = |step: &StepRecipe| step.is_body() || step.is_hair();
    let begins = |at: &usize| !is_bare(&recipe.steps[*at]) && recipe.first_of_outfit(*at) == *at;
    let scanned = (0..recipe.steps.len()).filter(begins).map(|at| {
        let step = &recipe.steps[at];
        let (garments, params) = (NewGarments::of(&recipe, step)?, params_of(step, Stage::Pose)?);
        let mut of_step = StepContext::new(context.walk, step, None);
        of_step.perform::<ScanStage>()?;
        let (name, scan) = (step.name.clone(), of_step.results.result::<ScanStage>()?);
        Ok(LaterScan { name, scan, garments, is_outfit: step.outfit.is_some(), params })
    });
    scanned.collect()
}

/// The scans among the inputs of a stage.
pub(super) fn input(scans: &[LaterScan]) -> Value {
    let one = |later: &LaterScan| {
        later.garments.among(json!({ "scan": later.scan.hash, "params": later.params }), later.is_outfit)
    };
    scans.iter().map(one).collect()
}

/// The cover of each body vertex in each of the scans. The garments of earlier steps are still worn in later scans.
///
/// **Shapes** one entry per scan, with V values.
///
/// **Errors** if a garment's template was painted on another body.
pub(super) fn covers(scans: &[LaterScan], bare: &Figure) -> Result<Vec<PerVertex<Cover>>, SessionError> {
    let mut covered = PerVertex::filled(Cover::Bare, bare.body().mesh.vertex_count());
    scans
        .iter()
        .map(|later| {
            let new = later.garments.cover(bare, &later.name)?;
            covered = covered.iter().zip(new.iter()).map(|(a, b)| looser(*a, *b)).collect();
            Ok(covered.clone())
        })
        .collect()
}
