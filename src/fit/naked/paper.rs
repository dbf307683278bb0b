//! The naked fit of Hu 2017, §5.2, as printed: Eq. 4, `argmin over θ, β of Σ ‖M(θ, β) − Y‖`.
//!
//! The paper leaves the following open. We choose the plainest reading and add nothing.
//! - **Initialisation**: the mean shape in the bind pose, which faces +Z, moved so that its centroid is above the scan's and
//!   its lowest point level with the scan's. No other heading or arm pose is tried.
//! - **Correspondences**: `Y` is the closest point of the scan's surface, found anew in each iteration for every vertex of
//!   the model (articulated ICP, which §6.1 names). None is rejected: no distance or normal gate, no rims of holes.
//! - **Weights**: every vertex counts the same. The norm is not squared, as printed: iteratively reweighted least squares,
//!   with the weight `1 / distance`.
//! - **Solver**: Gauss–Newton over translation, all joints and β, with the relative damping of all our fits, which does not
//!   move the minimum. No prior on pose or shape and no joint limits.
//! - **End**: two steps in a row that move no joint by 0.3 mm, or `iterations` steps.
//! - **Acceptance**: none. The report measures agreement with the scan but refuses nothing.

use super::params::NakedParams;
use super::problem::{NakedProblem, STILL};
use super::refine::ModelEstimate;
use crate::body::{Pose, Shape};
use crate::fit::correspondence::{ScanSurface, shift_onto};
use crate::fit::solver::{DAMPING, FitIteration, Posed, Residual, Singular, StoppingRule, Unknowns, iterate};
use crate::geometry::Vec3;
use rayon::prelude::*;

/// Distances below this count as this much in the reweighting, which would divide by zero. Metres: below any scanner's noise.
const LEAST_DISTANCE: f64 = 1e-4;

/// Minimises Eq. 4 from the bind pose.
pub(super) fn fit_eq_4(
    problem: &NakedProblem<'_>,
    params: &NakedParams,
    on_step: &mut dyn FnMut(&FitIteration),
) -> ModelEstimate {
    let shape = problem.model.mean_shape();
    let pose = initial_pose(problem, &shape);
    let mut found = ModelEstimate { pose, shape, iterations: 0, converged: false };
    let unknowns = Unknowns::without_fingers(&problem.body.skeleton, vec![true; problem.body.joint_count()], true);
    let rule = StoppingRule { steps: params.iterations, still: STILL, still_steps: 2, first_still: 0 };
    let settled = iterate(&rule, |number| {
        let posed = problem.body.posed(&found.pose, &found.shape);
        let (residuals, residual) = residuals_of_eq_4(problem.surface, &posed);
        let delta = problem.body.normal_equations(&posed, &residuals, &unknowns).solve(DAMPING)?;
        let (pose, shape) = problem.body.stepped(&posed, &found.pose, &found.shape, &delta);
        let moved = problem.moved(&posed, &pose, &shape);
        (found.pose, found.shape) = (pose, shape);
        on_step(&FitIteration { iteration: number + 1, moved, residual, surface: &problem.mesh(&posed) });
        Ok::<_, Singular>(moved)
    });
    (found.iterations, found.converged) = (settled.steps, settled.converged);
    found
}

fn initial_pose(problem: &NakedProblem<'_>, shape: &Shape) -> Pose {
    let mut pose = Pose::bind(problem.body.joint_count());
    let posed = problem.body.posed(&pose, shape);
    let areas = problem.model.template.vertex_areas();
    pose.translation += shift_onto(problem.surface, posed.points.iter().zip(areas.iter()));
    pose
}

/// Three residuals per vertex, one per axis, and the mean distance.
fn residuals_of_eq_4(surface: &ScanSurface, posed: &Posed) -> (Vec<Residual>, f64) {
    let gaps: Vec<Vec3> = posed.points.0.par_iter().map(|p| surface.index.closest(p).point - p).collect();
    let mean = gaps.iter().map(Vec3::norm).sum::<f64>() / gaps.len().max(1) as f64;
    let of_vertex = |(i, gap): (usize, &Vec3)| Residual::toward(i, *gap, 1.0 / gap.norm().max(LEAST_DISTANCE));
    (gaps.iter().enumerate().flat_map(of_vertex).collect(), mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::embedded_model;
    use crate::scan::Scan;

    #[test]
    fn every_vertex_pulls_with_one_unit_whatever_its_distance() {
        let model = embedded_model().unwrap();
        let far = model.template.map_points(|p| p + Vec3::new(0.0, 0.0, 0.4));
        let surface = ScanSurface::prepare(&Scan::from_clean_mesh(far, None));
        let body = crate::fit::solver::Articulated::of_model(&model);
        let posed = body.posed(&Pose::bind(body.joint_count()), &model.mean_shape());
        let (residuals, mean) = residuals_of_eq_4(&surface, &posed);
        assert_eq!(residuals.len(), 3 * model.template.vertex_count(), "no correspondence is rejected");
        assert!(mean > 0.05);
        for of_vertex in residuals.chunks(3) {
            let pull: Vec3 = of_vertex.iter().map(|r| r.normal * (r.weight * r.gap)).sum();
            let distance: f64 = of_vertex.iter().map(|r| r.gap * r.gap).sum::<f64>().sqrt();
            assert!(
                distance < LEAST_DISTANCE || (pull.norm() - 1.0).abs() < 1e-9,
                "an unsquared norm has a unit gradient"
            );
        }
    }
}
