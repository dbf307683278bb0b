//! The data flow of a session: the stages of the body, then those of each garment on the figure dressed so far.

use super::pipeline_stage::{StepContext, StepResults};
use super::walk::Walk;
use super::{animate, check, cloth, cut, evidence, figure, fit, pose, press, register, rig, scan, segment, stack};
use crate::cloth::ClothTrack;
use crate::cut::Garment;
use crate::motion::PoseTrack;
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::recipe::StepRecipe;
use crate::session::stage::{Stage, for_each_stage};
use crate::session::store::Kept;

macro_rules! dispatch {
    ($($(#[$about:meta])* $stage:ident $name:ident::$marker:ident [$($section:ident)?]
        $(body $body:tt)? $(garment $garment:tt)?;)*) => {
        fn perform(stage: Stage, context: &mut StepContext) -> Result<(), SessionError> {
            match stage {
                $(Stage::$stage => context.perform::<$name::$marker>(),)*
            }
        }
    };
}
for_each_stage!(dispatch);

/// Walks through all steps, or up to the named one.
pub(in crate::session) fn steps(walk: &mut Walk, last: Option<&str>) -> Result<Vec<StepResults>, SessionError> {
    let (all, ended) = steps_so_far(walk, last);
    ended.map(|()| all)
}

/// Like [`steps`], but gives the results of the steps before the first that has none, and why it has none.
pub(in crate::session) fn steps_so_far(
    walk: &mut Walk,
    last: Option<&str>,
) -> (Vec<StepResults>, Result<(), SessionError>) {
    let recipe = walk.session().recipe.clone();
    let mut all: Vec<StepResults> = Vec::new();
    for (at, step) in recipe.steps.iter().enumerate() {
        let mut context = StepContext::of_step(walk, &recipe, at, &all);
        let stages = Stage::of_step(step.is_body());
        if let Err(error) = stages.iter().try_for_each(|&stage| perform(stage, &mut context)) {
            return (all, Err(error));
        }
        let results = context.results;
        walk.end_step(step);
        all.push(results);
        if last == Some(step.name.as_str()) {
            break;
        }
    }
    (all, Ok(()))
}

/// Walks through all steps and all animations; returns the results of the steps.
pub(in crate::session) fn everything(walk: &mut Walk) -> Result<Vec<StepResults>, SessionError> {
    let all = steps(walk, None)?;
    animations(walk, &all, None)?;
    Ok(all)
}

/// The results of an animation: its poses, and its cloth if it is simulated.
pub(in crate::session) struct Moved {
    pub track: Kept<PoseTrack>,
    pub cloth: Option<Kept<ClothTrack>>,
}

/// Walks through all animations, or only the named one, on the figure of the last step.
///
/// **Requires** the results of all steps.
pub(in crate::session) fn animations(
    walk: &mut Walk,
    steps: &[StepResults],
    only: Option<&str>,
) -> Result<Vec<Moved>, SessionError> {
    let recipe = walk.session().recipe.clone();
    let Some(last) = recipe.steps.last() else { return Ok(Vec::new()) };
    let wanted = recipe.animations.iter().filter(|animation| only.is_none_or(|name| name == animation.name));
    let mut moved = Vec::new();
    for animation in wanted {
        let mut context = StepContext::of_animation(walk, last, steps.last(), animation);
        perform(Stage::Animate, &mut context)?;
        let track = context.results.result::<animate::AnimateStage>()?;
        let cloth = if animation.mode().is_simulated() {
            perform(Stage::Cloth, &mut context)?;
            Some(context.results.result::<cloth::ClothStage>()?)
        } else {
            None
        };
        moved.push(Moved { track, cloth });
    }
    Ok(moved)
}

/// Walks up to the cut of one garment.
pub(in crate::session) fn cut_of(walk: &mut Walk, layer: &str) -> Result<Kept<Garment>, SessionError> {
    let recipe = walk.session().recipe.clone();
    recipe.step(layer)?;
    let Some(before) = recipe.steps.iter().take_while(|s| s.name != layer).last() else {
        return Err(SessionError::MaskOnBody);
    };
    let all = steps(walk, Some(&before.name))?;
    let mut context = StepContext::of_step(walk, &recipe, all.len(), &all);
    for &stage in Stage::OF_GARMENT.iter().take_while(|stage| **stage <= Stage::Cut) {
        perform(stage, &mut context)?;
    }
    context.results.result::<cut::CutStage>()
}

/// The scan of a step, independent of earlier steps.
pub(in crate::session) fn scan_of(walk: &mut Walk, step: &StepRecipe) -> Result<Kept<Scan>, SessionError> {
    let mut context = StepContext::new(walk, step, None);
    context.perform::<scan::ScanStage>()?;
    context.results.result::<scan::ScanStage>()
}
