//! The data flow of a session: the body, then each garment on the figure dressed so far, then the animations.

use super::body::body;
use super::garment::{CutOut, GarmentStep};
use super::memo::input::ModelInput;
use super::memo::walk::Walk;
use super::results::StepResults;
use super::stages::animate::{self, ANIMATE, ClipInput};
use super::stages::cloth::{self, CLOTH};
use super::stages::step_scan::begin_scan;
use super::tryon;
use crate::body::Figure;
use crate::cloth::ClothTrack;
use crate::motion::PoseTrack;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{AnimationRecipe, Recipe, Step, StepRecipe};
use crate::session::stage::Stage;
use crate::session::store::Kept;

/// The stages of an animation.
pub fn stages_of_animation(animation: &AnimationRecipe) -> &'static [Stage] {
    const ALL: &[Stage] = &[Stage::Animate, Stage::Cloth];
    if animation.mode().is_simulated() { ALL } else { &ALL[..1] }
}

impl Session {
    /// The number of stages of a build.
    pub fn stage_count(&self) -> usize {
        let of_steps = self.recipe.steps.iter().map(|step| step.kind().stages().len());
        let of_animations = self.recipe.animations.iter().map(|animation| stages_of_animation(animation).len());
        of_steps.chain(of_animations).sum()
    }
}

/// Walks through all steps, or up to the named one. A garment that failed leaves the figure as it was before.
pub(in crate::session) fn steps(walk: &mut Walk, last: Option<&str>) -> Result<Vec<StepResults>, SessionError> {
    let SoFar { results, ended, .. } = steps_so_far(walk, last);
    ended.map(|()| results)
}

/// How far a walk came.
pub(in crate::session) struct SoFar {
    /// The results, one per step, of the steps before the walk ended.
    pub results: Vec<StepResults>,
    /// Why it ended before the last one, if it did.
    pub ended: Result<(), SessionError>,
    /// The error of the first garment that failed; *not built* if it did not run now.
    failed: Option<SessionError>,
}

/// Like [`steps`], but gives the results of the steps before the first at which the walk ends, and why.
pub(in crate::session) fn steps_so_far(walk: &mut Walk, last: Option<&str>) -> SoFar {
    let recipe = walk.session().recipe.clone();
    let (mut all, mut failed): (Vec<StepResults>, _) = (Vec::new(), None);
    for (at, step) in recipe.steps.iter().enumerate() {
        let is_last = last == Some(step.name.as_str());
        let next = recipe.steps.get(at + 1).filter(|_| !is_last);
        match (one(walk, &recipe, at, &all, next), all.last()) {
            (Ok(results), _) => {
                all.push(results);
                walk.end_step(step);
            }
            (Err(error), Some(before)) if !is_last && walk.has_failed(&step.name) => {
                failed = failed.or(Some(error));
                all.push(before.of_failed_step());
            }
            (Err(error), _) => return SoFar { results: all, ended: Err(error), failed },
        }
        if is_last {
            break;
        }
    }
    SoFar { results: all, ended: Ok(()), failed }
}

/// Entry `at` of a recipe, given the results of all entries before it. Where little runs in parallel, the scan of the `next` entry is
/// begun.
fn one(
    walk: &mut Walk,
    recipe: &Recipe,
    at: usize,
    before: &[StepResults],
    next: Option<&StepRecipe>,
) -> Result<StepResults, SessionError> {
    match recipe.variant(&recipe.steps[at])? {
        Step::Body(step) => body(walk, recipe, step, next),
        Step::TryOn(step) => tryon::put_on(walk, &recipe.steps[at], step, before),
        Step::Garment(..) | Step::Outfit(..) | Step::Hair(..) => {
            let garment = GarmentStep::of(walk, recipe, at, before)?;
            let cut = garment.cut_out(walk)?;
            begin_scan(walk, next);
            garment.put_on(walk, &cut)
        }
    }
}

/// Walks up to the cut of one garment.
pub(in crate::session) fn cut_of(walk: &mut Walk, layer: &str) -> Result<CutOut, SessionError> {
    let recipe = walk.session().recipe.clone();
    recipe.step(layer)?.check_labelled()?;
    let at = recipe.steps.iter().position(|step| step.name == layer).unwrap_or_default();
    let Some(last) = recipe.last_before_scan(at) else { return Err(SessionError::MaskOnBody) };
    let all = steps(walk, Some(&recipe.steps[last].name))?;
    GarmentStep::of(walk, &recipe, at, &all)?.cut_out(walk)
}

/// Walks through all steps and all animations.
///
/// **Errors** also, after all the others, if a garment failed.
pub(in crate::session) fn everything(walk: &mut Walk) -> Result<(), SessionError> {
    let SoFar { results, ended, failed } = steps_so_far(walk, None);
    ended?;
    animations(walk, &results, None)?;
    failed.map_or(Ok(()), Err)
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
    let Some(last) = steps.last() else { return Ok(Vec::new()) };
    let wanted = recipe.animations.iter().filter(|animation| only.is_none_or(|name| name == animation.name));
    wanted.map(|animation| moved(walk, last.figure, animation)).collect()
}

fn moved(walk: &mut Walk, figure: Kept<Figure>, animation: &AnimationRecipe) -> Result<Moved, SessionError> {
    let (model, clip) = (ModelInput::of(walk.session()), ClipInput::of(walk.session(), animation)?);
    let at = &mut walk.at_animation(animation.key(), &animation.name);
    let AnimationRecipe { clip_name, fps, frames, fabrics, .. } = animation.clone();
    let params = animation.params()?;
    let inputs = animate::Inputs { figure, model: model.clone(), clip, clip_name, fps, frames, params };
    let track = at.run(ANIMATE, inputs, animate::run)?.kept;
    if !animation.mode().is_simulated() {
        return Ok(Moved { track, cloth: None });
    }
    let (skinning, mode, solver) = (animation.skinning.unwrap_or_default(), animation.mode(), animation.solver());
    let params = animation.cloth_params()?;
    let inputs = cloth::Inputs { figure, model, track, skinning, mode, solver, fabrics, params };
    Ok(Moved { track, cloth: Some(at.run(CLOTH, inputs, cloth::run)?.kept) })
}
