//! The loop of Gauss–Newton steps and its convergence criterion.

use crate::geometry::TriMesh;

/// Progress of a fit.
#[derive(Clone, Copy, Debug)]
pub struct FitIteration<'a> {
    /// Iterations done since the fit began, or began anew.
    pub iteration: usize,
    /// Greatest move of a joint in the last iteration, in metres; of a vertex in a fit without joints.
    pub moved: f64,
    /// Weighted mean of the residuals before that move, in metres.
    pub residual: f64,
    /// The fitted surface before that move, in the scan's frame: the body, or all layers of the figure in order, garments
    /// downsampled as in the fit.
    pub surface: &'a TriMesh,
}

/// When a loop of steps ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StoppingRule {
    /// Greatest number of steps.
    pub(crate) steps: usize,
    /// A step that moves every joint by less than this, in metres, counts as still.
    pub(crate) still: f64,
    /// Number of still steps in a row that ends the loop.
    pub(crate) still_steps: usize,
    /// Earlier steps do not count as still, because their gates are wider than the last ones.
    pub(crate) first_still: usize,
}

impl StoppingRule {
    /// Exactly `steps` steps, whatever they move.
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
    /// Why the loop ended early: a step could not be taken.
    pub(crate) stopped: Option<E>,
}

/// Takes steps until the rule ends them or a step fails. `step` receives its number, from 0, and returns the greatest move of a
/// joint in metres (of a vertex in a fit without joints).
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
