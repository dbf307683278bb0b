//! The one way to run a stage: [`At::run`].
//!
//! A stage is a version, a struct of inputs, and a function of these. What the inputs serialise to is hashed, recorded and
//! compared; the function sees nothing else, so nothing that it depends on can be forgotten. It is a `fn`, which captures
//! nothing. Names and paths are no inputs: errors get the step's name here, and [`mention`](super::mention) puts names into
//! findings when they are reported.

use super::event::{Made, OnProgress};
pub(in crate::session) use super::run::{Run, RunError};
use super::walk::{StageCall, Walk};
use crate::session::error::SessionError;
use crate::session::stage::Stage;
use crate::session::store::Store;
use serde::Serialize;

/// A stage and the version of its code. Bump the version when the output changes for equal inputs; a test compares the two.
#[derive(Clone, Copy)]
pub(in crate::session) struct Code {
    stage: Stage,
    version: u32,
}

impl Code {
    pub const fn new(stage: Stage, version: u32) -> Self {
        Self { stage, version }
    }

    pub fn version(self) -> u32 {
        self.version
    }
}

/// The place in a recipe whose stages run: a step, or an animation.
pub(in crate::session) struct At<'a, 'w> {
    walk: &'a mut Walk<'w>,
    /// The name under which its stages are recorded.
    key: String,
    /// The animation's name, if it is one.
    animation: Option<&'a str>,
}

impl<'w> Walk<'w> {
    /// At a step.
    pub fn at<'a>(&'a mut self, step: &str) -> At<'a, 'w> {
        At { walk: self, key: step.into(), animation: None }
    }

    /// At an animation, recorded under `key`.
    pub fn at_animation<'a>(&'a mut self, key: String, name: &'a str) -> At<'a, 'w> {
        At { walk: self, key, animation: Some(name) }
    }
}

impl At<'_, '_> {
    /// Begins a stage on a thread of its own, if it will have to run: [`At::run`] then waits for it.
    pub fn begin<I: Serialize + Clone + Send + 'static, T: Send + 'static>(
        &mut self,
        Code { stage, version }: Code,
        inputs: &I,
        run: fn(I, &Store, OnProgress) -> Run<T>,
    ) {
        let Ok(values) = serde_json::to_value(inputs) else { return };
        let call = StageCall { step: &self.key, stage, version, inputs: values };
        self.walk.begin(&call, || inputs.clone(), run);
    }

    /// The result of a stage: the recorded one if its inputs are equal, otherwise that of `run`, as the walk requires.
    pub fn run<I: Serialize, T: Serialize + 'static>(
        &mut self,
        Code { stage, version }: Code,
        inputs: I,
        run: fn(I, &Store, OnProgress) -> Run<T>,
    ) -> Result<Made<T>, SessionError> {
        let values = serde_json::to_value(&inputs).map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
        let call = StageCall { step: &self.key, stage, version, inputs: values };
        let (step, animation) = (&self.key, self.animation);
        let begun = self.walk.begun(&call);
        self.walk.stage(call, |session, on_progress| {
            let begun = begun.and_then(|begun| begun.ended(on_progress));
            let result = begun.unwrap_or_else(|| run(inputs, &session.store, on_progress));
            result.map_err(|error| located(error, step, animation, stage))
        })
    }
}

fn located(error: RunError, step: &str, animation: Option<&str>, stage: Stage) -> SessionError {
    match (error, animation) {
        (RunError::Session(error), _) => error,
        (RunError::NothingLeft(file), _) => SessionError::nothing_left(&file, None, step),
        (RunError::Stage(source), Some(name)) => {
            SessionError::Animation { name: name.into(), source: Box::new(source) }
        }
        // People know the evidence as a part of the segmentation.
        (RunError::Stage(source), None) if stage == Stage::Evidence => {
            SessionError::stage(step, Stage::Segment, source)
        }
        (RunError::Stage(source), None) => SessionError::stage(step, stage, source),
    }
}
