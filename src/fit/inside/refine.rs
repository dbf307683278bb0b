//! Gauss–Newton steps of a fit inside a scan.

use super::problem::InsideProblem;
use crate::body::{Pose, Shape};
use crate::fit::solver::{FitIteration, Singular, StoppingRule, Unknowns, iterate, mean_residual};
use crate::geometry::SurfaceIndex;
use nalgebra::DVector;

/// The estimate of the pose after some iterations.
pub(crate) struct PoseEstimate {
    pub(crate) pose: Pose,
    pub(crate) iterations: usize,
    pub(crate) converged: bool,
}

impl InsideProblem<'_> {
    pub(super) fn refine(
        &self,
        start: Pose,
        previous: &Pose,
        on_step: &mut dyn FnMut(&FitIteration),
        log: &mut Vec<String>,
    ) -> PoseEstimate {
        /// A step is still if it moves every joint by less than this, in metres.
        const STILL: f64 = 3e-4;
        /// A step reverses the previous one if the cosine between them is below the first; if no joint moves by more than the
        /// second, in metres, the steps oscillate: by 0.7 mm where a slit showed the skin below a skirt.
        const REVERSED: f64 = -0.5;
        const OSCILLATION: f64 = 2e-3;
        let mut pose = start;
        let (mut last_delta, mut share, mut moved) = (DVector::zeros(self.body.unknown_count()), 1.0, f64::INFINITY);
        let stiffness = self.stiffness();
        let figure_samples = self.samples(self.params.samples);
        let scan_samples = if self.params.method.is_weighted() {
            self.surface.confidence_weighted_samples(self.params.samples)
        } else {
            self.surface.samples(self.params.samples)
        };
        let unknowns = Unknowns { joints: self.held.iter().map(|held| !held).collect(), shape: false };
        let mut index: Option<SurfaceIndex> = None;
        /// The gates are narrow from this iteration on.
        const ANNEALED: usize = 8;
        let rule = StoppingRule { steps: self.params.iterations, still: STILL, still_steps: 2, first_still: ANNEALED };
        let settled = iterate(&rule, |iteration| {
            let t = (iteration as f64 / ANNEALED as f64).min(1.0);
            let reach = 0.12 * (1.0 - t) + 0.03 * t;
            let posed = self.posed(&pose);
            let mesh = self.mesh(&posed);
            let normals = mesh.vertex_normals();
            let index = match &mut index {
                Some(index) => {
                    index.follow(&mesh);
                    index
                }
                none => none.insert(SurfaceIndex::prepare(&mesh)),
            };
            let mut residuals = self.figure_to_scan(&posed, &normals, &figure_samples, reach, 0.3 + 0.3 * t);
            residuals.extend(self.scan_to_figure(index, &normals, &scan_samples, reach, 0.3 + 0.3 * t));
            let mut equations = self.body.normal_equations(&posed, &residuals, &unknowns);
            equations.add_pose_prior(&posed, &pose, &self.prior(previous, &stiffness));
            for i in 0..equations.h.nrows() {
                equations.h[(i, i)] = equations.h[(i, i)] * (1.0 + 1e-4) + 1e-6;
            }
            equations.freeze_all_but(&unknowns);
            let delta = if self.params.method.is_constrained() && iteration >= 2 {
                self.constrained_step(&posed, &normals, equations, log)
            } else {
                equations.solve(0.0)
            };
            let mut delta = delta?;
            // If skin is as near to one side of the scan as to another, steps oscillate: shorten them.
            let is_reversed = delta.dot(&last_delta) < REVERSED * delta.norm() * last_delta.norm();
            share = if is_reversed && moved < OSCILLATION { 0.5 * share } else { share };
            last_delta.copy_from(&delta);
            delta *= share;
            let next = self.body.stepped(&posed, &pose, &Shape(Vec::new()), &delta).0;
            let after = posed.skeleton.joints_in_world(&next);
            moved = self.body.greatest_move(&posed, &after);
            pose = next;
            on_step(&FitIteration {
                iteration: iteration + 1,
                moved,
                residual: mean_residual(&residuals),
                surface: &mesh,
            });
            Ok::<_, Singular>(moved)
        });
        PoseEstimate { pose, iterations: settled.steps, converged: settled.converged }
    }
}
