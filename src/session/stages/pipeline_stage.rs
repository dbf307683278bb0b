//! The trait of a stage, and the context in which it runs: its step and the results of earlier stages.

use super::event::{OnProgress, Outcome};
use super::hair::HAIR_AREA;
use super::kinds::NewGarments;
use super::walk::{StageCall, Walk};
use crate::body::Figure;
use crate::fit::{FittedBody, InsideParams, PoseInside, RegisteredBody};
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{AnimationRecipe, Recipe, StepRecipe};
use crate::session::stage::Stage;
use crate::session::store::{ContentHash, Kept};
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::rc::Rc;

/// A stage of the pipeline. Each has its own file in this folder and a line in the registry; its parameters are
/// declared with their type.
pub(in crate::session) trait PipelineStage {
    /// The stage's identifier.
    const STAGE: Stage;
    /// The version of the stage's code. Bump when the output changes for equal inputs; a test compares the two.
    const VERSION: u32;
    /// The inputs of `run`.
    type Inputs;
    /// The result of `run`.
    type Output: Serialize;

    /// Collects the inputs and lists everything that the output depends on. The stage is up to date as long as these
    /// values stay equal. Large values are replaced by their hashes.
    fn inputs(context: &mut StepContext) -> Result<(Self::Inputs, Value), SessionError>;

    /// Loads the inputs, calls the stage's module, and reports measures and findings.
    fn run(
        inputs: Self::Inputs,
        step: &StepRecipe,
        session: &Session,
        on_progress: OnProgress,
    ) -> Result<Outcome<Self::Output>, SessionError>;
}

/// The context of a stage.
pub(in crate::session) struct StepContext<'a, 'w> {
    pub walk: &'a mut Walk<'w>,
    pub step: &'a StepRecipe,
    /// The animation, for the stage that belongs to no step; `step` is the last one then.
    pub animation: Option<&'a AnimationRecipe>,
    /// The results of the previous step, of the last one for an animation; `None` in the body's step.
    pub inner: Option<&'a StepResults>,
    /// The results of the last step with an earlier scan: those of `inner`, unless the step before is of the same outfit; those of
    /// the body for its hair.
    before_scan: Option<&'a StepResults>,
    /// The results of the body's step; `None` in it, and where a stage runs by itself.
    body: Option<&'a StepResults>,
    /// The results of this step so far.
    pub results: StepResults,
    /// The scans of later steps to which the body's shape is fitted, once a stage has requested them.
    pub later_scans: Option<Rc<[LaterScan]>>,
}

impl<'a, 'w> StepContext<'a, 'w> {
    pub fn new(walk: &'a mut Walk<'w>, step: &'a StepRecipe, inner: Option<&'a StepResults>) -> Self {
        let results = StepResults::of(&step.name);
        Self { walk, step, animation: None, inner, before_scan: inner, body: None, results, later_scans: None }
    }

    /// The context of step `at` of the recipe, given the results of all steps before it.
    pub fn of_step(walk: &'a mut Walk<'w>, recipe: &'a Recipe, at: usize, before: &'a [StepResults]) -> Self {
        let before_scan = recipe.last_before_scan(at).and_then(|last| before.get(last));
        Self { before_scan, body: before.first(), ..Self::new(walk, &recipe.steps[at], before.last()) }
    }

    /// The context of an animation; `last` is the last step, with its results.
    pub fn of_animation(
        walk: &'a mut Walk<'w>,
        last: &'a StepRecipe,
        results: Option<&'a StepResults>,
        animation: &'a AnimationRecipe,
    ) -> Self {
        let own = StepResults::of(&animation.key());
        let animation = Some(animation);
        Self { animation, results: own, ..Self::new(walk, last, results) }
    }

    /// The results of the step before a garment's step.
    pub fn inner(&self) -> Result<&'a StepResults, SessionError> {
        self.inner.ok_or_else(|| SessionError::GarmentBeforeBody { name: self.step.name.clone() })
    }

    /// The results of the last step with an earlier scan, on which the figure is still without the garments of this one.
    pub fn before_scan(&self) -> Result<&'a StepResults, SessionError> {
        self.before_scan.ok_or_else(|| SessionError::GarmentBeforeBody { name: self.step.name.clone() })
    }

    /// The fit of the body, if its scan shows hair that is no part of it.
    pub fn fit_with_hair(&self) -> Result<Option<Kept<FittedBody>>, SessionError> {
        let Some(body) = self.body else { return Ok(None) };
        let fitted = body.output(Stage::Fit)?;
        let record = self.walk.session().state.record(&body.step, Stage::Fit);
        let has_hair = record.is_some_and(|of| of.output == fitted && of.measures.contains_key(HAIR_AREA));
        Ok(has_hair.then(|| Kept::named(fitted)))
    }

    /// Runs a stage of the step, unless it is up to date.
    pub fn perform<S: PipelineStage>(&mut self) -> Result<(), SessionError> {
        let (inputs, values) = S::inputs(self)?;
        let step = self.step;
        let name = self.results.step.clone();
        let call = StageCall { step: &name, stage: S::STAGE, version: S::VERSION, inputs: values };
        let kept = self.walk.stage(call, |session, on_progress| S::run(inputs, step, session, on_progress))?;
        self.results.outputs.insert(S::STAGE, kept.hash);
        Ok(())
    }
}

/// The results of a step's stages, as artefacts.
pub(in crate::session) struct StepResults {
    step: String,
    outputs: BTreeMap<Stage, ContentHash>,
}

impl StepResults {
    fn of(name: &str) -> Self {
        Self { step: name.into(), outputs: BTreeMap::new() }
    }

    /// The result of a stage that has run.
    pub fn result<S: PipelineStage>(&self) -> Result<Kept<S::Output>, SessionError> {
        self.output(S::STAGE).map(Kept::named)
    }

    /// The figure after the step. Only [`Session::figure`] loads it.
    pub fn figure(&self) -> Result<Kept<Figure>, SessionError> {
        self.output(Stage::Figure).map(Kept::named)
    }

    /// The artefact with the pose of the step's person.
    pub fn pose(&self) -> Result<StepPose, SessionError> {
        match self.outputs.get(&Stage::Pose) {
            Some(inside) => Ok(StepPose::Inside(Kept::named(*inside))),
            None => self.output(Stage::Register).map(|registered| StepPose::Naked(Kept::named(registered))),
        }
    }

    fn output(&self, stage: Stage) -> Result<ContentHash, SessionError> {
        let output = self.outputs.get(&stage).copied();
        output.ok_or_else(|| SessionError::NotBuilt { step: self.step.clone(), stage })
    }
}

/// The artefact that holds the pose of a step.
#[derive(Clone, Copy)]
pub(in crate::session) enum StepPose {
    /// That of the body's step.
    Naked(Kept<RegisteredBody>),
    /// That of a garment's step.
    Inside(Kept<PoseInside>),
}

impl StepPose {
    /// The artefact's name.
    pub fn hash(&self) -> ContentHash {
        match self {
            Self::Naked(registered) => registered.hash,
            Self::Inside(inside) => inside.hash,
        }
    }
}

/// The scan of a later step, as evidence of the body's shape.
pub(in crate::session) struct LaterScan {
    pub name: String,
    pub scan: Kept<Scan>,
    pub garments: NewGarments,
    /// Whether they are those of an outfit.
    pub is_outfit: bool,
    pub params: InsideParams,
}
