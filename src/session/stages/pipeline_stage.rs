//! The trait of a stage, and what a stage finds where it runs: its step, and the results of the stages before it.

use super::event::{OnProgress, Outcome};
use super::walk::{StageCall, Walk};
use crate::body::Figure;
use crate::fit::{InsideParams, PoseInside, RegisteredBody};
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{GarmentKind, StepRecipe};
use crate::session::stage::Stage;
use crate::session::store::{ContentHash, Kept};
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::rc::Rc;

/// A stage of the pipeline. Each has a file of its own in this folder and a line in the registry; its parameters are
/// declared where their type is.
pub(in crate::session) trait PipelineStage {
    /// Which one it is.
    const STAGE: Stage;
    /// The version of the stage's code. Bump when the output changes for equal inputs; a test compares the two.
    const VERSION: u32;
    /// What `run` reads.
    type Inputs;
    /// What `run` makes.
    type Output: Serialize;

    /// Finds the inputs, and names everything that the output depends on: the stage is up to date as long as these values
    /// stay equal. Hashes stand for large ones.
    fn inputs(context: &mut StepContext) -> Result<(Self::Inputs, Value), SessionError>;

    /// Loads the inputs, calls the stage's module, and reports what was measured and noticed.
    fn run(
        inputs: Self::Inputs,
        step: &StepRecipe,
        session: &Session,
        on_progress: OnProgress,
    ) -> Result<Outcome<Self::Output>, SessionError>;
}

/// Where a stage runs.
pub(in crate::session) struct StepContext<'a, 'w> {
    pub walk: &'a mut Walk<'w>,
    pub step: &'a StepRecipe,
    /// The results of the step before; `None` in the body's step.
    pub inner: Option<&'a StepResults>,
    /// The results of this step so far.
    pub results: StepResults,
    /// The scans of later steps that share in the body's shape, once a stage has asked for them.
    pub later_scans: Option<Rc<[LaterScan]>>,
}

impl<'a, 'w> StepContext<'a, 'w> {
    pub fn new(walk: &'a mut Walk<'w>, step: &'a StepRecipe, inner: Option<&'a StepResults>) -> Self {
        Self { walk, step, inner, results: StepResults::of(step), later_scans: None }
    }

    /// The results of the step before a garment's.
    pub fn inner(&self) -> Result<&'a StepResults, SessionError> {
        self.inner.ok_or_else(|| SessionError::GarmentBeforeBody { name: self.step.name.clone() })
    }

    /// Runs a stage of the step, unless it is up to date.
    pub fn perform<S: PipelineStage>(&mut self) -> Result<(), SessionError> {
        let (inputs, values) = S::inputs(self)?;
        let step = self.step;
        let call = StageCall { step: &step.name, stage: S::STAGE, version: S::VERSION, inputs: values };
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
    fn of(step: &StepRecipe) -> Self {
        Self { step: step.name.clone(), outputs: BTreeMap::new() }
    }

    /// The result of a stage that has run.
    pub fn result<S: PipelineStage>(&self) -> Result<Kept<S::Output>, SessionError> {
        self.output(S::STAGE).map(Kept::named)
    }

    /// The figure with what the step brought. Only [`Session::figure`] loads it.
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

/// Where the pose of a step is.
#[derive(Clone, Copy)]
pub(in crate::session) enum StepPose {
    /// In the body's step.
    Naked(Kept<RegisteredBody>),
    /// In a garment's step.
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

/// The scan of a later step, as far as it tells something about the body.
pub(in crate::session) struct LaterScan {
    pub name: String,
    pub scan: Kept<Scan>,
    pub kind: GarmentKind,
    pub params: InsideParams,
}
