//! The loop of Gauss–Newton steps, and when it has settled.

use crate::geometry::TriMesh;

/// Progress of a fit.
#[derive(Clone, Copy, Debug)]
pub struct FitIteration<'a> {
    /// Iterations done.
    pub iteration: usize,
    /// Greatest move of a joint in the last one, in metres; of a vertex, where no joints are fitted.
    pub moved: f64,
    /// Mean distance, in metres, of what is drawn together, each as it weighs, before that move.
    pub residual: f64,
    /// What is fitted, in the scan's frame, before that move: the body, or all layers of the figure one after the other, the
    /// garments with as many of their vertices as the fit looks at.
    pub surface: &'a TriMesh,
}

/// When a loop of steps ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StoppingRule {
    /// Steps at most.
    pub(crate) steps: usize,
    /// A step that moves every joint by less than this, in metres, counts as still.
    pub(crate) still: f64,
    /// Still steps in a row that end the loop.
    pub(crate) still_steps: usize,
    /// Steps before this one do not count as still: their gates are wider than the last ones.
    pub(crate) first_still: usize,
}

impl StoppingRule {
    /// Always `steps` steps.
    pub(crate) fn always(steps: usize) -> Self {
        Self { steps, still: 0.0, still_steps: usize::MAX, first_still: 0 }
    }
}

/// How a loop ended.
#[derive(Clone, Debug)]
pub(crate) struct Settled<E> {
    /// Steps taken.
    pub(crate) steps: usize,
    /// Whether the last step was still.
    pub(crate) converged: bool,
    /// Why a step could not be taken, which ended the loop.
    pub(crate) stopped: Option<E>,
}

/// Takes steps until the rule ends them or one cannot be taken. `step` is given its number from 0, and returns the greatest
/// move of a joint (of a vertex, where no joints are fitted) in metres.
pub(crate) fn iterate<E>(rule: &StoppingRule, mut step: impl FnMut(usize) -> Result<f64, E>) -> Settled<E> {
    let mut still = 0;
    for number in 0..rule.steps {
        let moved = match step(number) {
            Ok(moved) => moved,
            Err(error) => return Settled { steps: number, converged: still > 0, stopped: Some(error) },
        };
        still = if moved < rule.still && number >= rule.first_still { still + 1 } else { 0 };
        if still >= rule.still_steps {
            return Settled { steps: number + 1, converged: true, stopped: None };
        }
    }
    Settled { steps: rule.steps, converged: still > 0, stopped: None }
}
