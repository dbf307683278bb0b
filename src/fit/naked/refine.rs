//! Gauss–Newton steps of the naked fit, from wide gates to narrow ones.

use super::fitted_body::FittedBody;
use super::problem::{FINEST, NakedProblem, STILL};
use crate::body::{Pose, Shape};
use crate::fit::solver::{DAMPING, FitIteration, Phase, Singular, StoppingRule, iterate};
use crate::geometry::SurfaceIndex;

/// The estimate of shape and pose after some iterations.
#[derive(Clone)]
pub(crate) struct ModelEstimate {
    pub(crate) pose: Pose,
    pub(crate) shape: Shape,
    pub(crate) iterations: usize,
    pub(crate) converged: bool,
}

impl ModelEstimate {
    /// The estimate of an earlier fit.
    pub(crate) fn at(fitted: &FittedBody) -> Self {
        let FittedBody { pose, shape, report, .. } = fitted;
        let (pose, shape) = (pose.clone(), shape.clone());
        Self { pose, shape, iterations: report.iterations, converged: report.converged }
    }
}

/// The threshold of earlier phases, in metres: the narrower gates that follow move joints by 2 mm again.
const NEARLY_STILL: f64 = 1e-3;

impl NakedProblem<'_> {
    pub(crate) fn refine(&self, pose: Pose, shape: Shape, on_step: &mut dyn FnMut(&FitIteration)) -> ModelEstimate {
        let n = self.params.samples;
        let phases = [
            Phase { iterations: 5, samples: n / 3, reach: 0.10, least_cosine: 0.4, limbs_only: false, shape: true },
            Phase { iterations: 5, samples: n / 2, reach: 0.06, least_cosine: 0.5, limbs_only: false, shape: true },
            Phase { iterations: self.params.iterations, samples: n, ..FINEST },
        ];
        let mut found = ModelEstimate { pose, shape, iterations: 0, converged: false };
        self.run_phases(&phases, &mut found, on_step);
        found
    }

    /// Runs phases from the estimate so far.
    pub(super) fn run_phases(
        &self,
        phases: &[Phase],
        found: &mut ModelEstimate,
        on_step: &mut dyn FnMut(&FitIteration),
    ) {
        let mut index = self.index.clone();
        for phase in phases {
            self.run(phase, found, &mut index, on_step);
        }
    }

    /// Runs a phase from the estimate so far; `index` holds the model in some pose.
    fn run(
        &self,
        phase: &Phase,
        found: &mut ModelEstimate,
        index: &mut SurfaceIndex,
        on_step: &mut dyn FnMut(&FitIteration),
    ) {
        let places = self.places(phase.samples);
        let (is_still, rounds) = if phase.reach > FINEST.reach { (NEARLY_STILL, 1) } else { (STILL, 2) };
        let rule = StoppingRule { steps: phase.iterations, still: is_still, still_steps: rounds, first_still: 0 };
        let settled = iterate(&rule, |_| {
            let posed = self.body.posed(&found.pose, &found.shape);
            index.follow(&self.mesh(&posed));
            let (mut equations, residual) = self.equations(phase, &places, &posed, &found.pose, index);
            equations.add_shape_prior(&found.shape, self.params.shape_prior);
            equations.freeze_all_but(&self.unknowns(phase.shape));
            let delta = equations.solve(DAMPING)?;
            let (pose, shape) = self.body.stepped(&posed, &found.pose, &found.shape, &delta);
            let moved = self.moved(&posed, &pose, &shape);
            (found.pose, found.shape) = (pose, shape);
            found.iterations += 1;
            on_step(&FitIteration { iteration: found.iterations, moved, residual, surface: index.mesh() });
            Ok::<_, Singular>(moved)
        });
        found.converged = settled.converged;
    }
}
