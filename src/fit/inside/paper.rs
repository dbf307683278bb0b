//! The fit inside a scan of Hu 2017, §6.1, as printed: Eq. 5, `argmin over θ of Σ ‖N(θ) − M_p‖²`, then Eq. 6, the same
//! subject to `(N_corr(i)(M_p) − Nᵢ) · nᵢ > 0`.
//!
//! The paper leaves the following open. We choose the plainest reading and add nothing.
//! - **Initialisation**: the previous step's pose, in the frame of its scan. No other heading is tried.
//! - **N(θ)**: every vertex of the figure, body and garments, hidden or not; garments have one vertex per 10 mm, which is
//!   the resolution at which all our fits see them. Every vertex counts the same.
//! - **Correspondences**: `corr(i)` is the closest point of the scan's surface, found anew in each iteration (articulated
//!   ICP). None is rejected: no distance or normal gate, no rims of holes, no robust weights, no confidence.
//! - **nᵢ**: the normal of the *body's* vertex in its present pose, not of the scan.
//! - **The selected part** that Eq. 6 constrains: the body vertices that the garment's template covers.
//! - **Chosen joint angles**: the parameter `joints`; the root always moves.
//! - **The constraint**: `> 0` is `≥ 0`, linearised in the step: one row of a quadratic program per constrained vertex. The
//!   rows are hard: no slack, no margin, no offset afterwards.
//! - **Solver**: Gauss–Newton with the relative damping of all our fits, which does not move the minimum. First Eq. 5 until
//!   it settles, then Eq. 6 from there, in the order of the paper. If no step satisfies all rows the fit ends with the pose
//!   so far, and the report says so. No pose prior and no joint limits.
//! - **End** of each: two steps in a row that move no joint by 0.3 mm, or `iterations` steps.
//! - **Acceptance**: none. The report measures agreement with the scan but refuses nothing.

use super::cover::Cover;
use super::problem::InsideProblem;
use super::refine::PoseEstimate;
use crate::body::{Pose, Shape};
use crate::fit::correspondence::ScanSurface;
use crate::fit::solver::{
    Articulated, DAMPING, FitIteration, NormalEquations, Posed, Residual, StoppingRule, Unknowns, iterate,
};
use crate::geometry::{PerVertex, Point, Vec3, VertexId};
use crate::numerics::{QpRow, QuadraticProgram};
use nalgebra::DVector;
use rayon::prelude::*;

/// A joint moved less than this in a step, in metres: far below the scan's noise.
const STILL: f64 = 3e-4;

/// Minimises Eq. 5, then Eq. 6, from the previous step's pose.
pub(super) fn fit_eqs_5_and_6(
    problem: &InsideProblem<'_>,
    previous: &Pose,
    on_step: &mut dyn FnMut(&FitIteration),
    log: &mut Vec<String>,
) -> PoseEstimate {
    let unknowns = Unknowns { joints: problem.held.iter().map(|held| !held).collect(), shape: false };
    let rule = StoppingRule { steps: problem.params.iterations, still: STILL, still_steps: 2, first_still: 0 };
    let mut pose = previous.clone();
    let mut iterations = 0;
    let mut converged = false;
    for is_constrained in [false, true] {
        let settled = iterate(&rule, |_| {
            let posed = problem.posed(&pose);
            let closest = closest_points(problem.surface, &posed);
            let (residuals, residual) = residuals_of_eq_5(&posed, &closest);
            let mut equations = problem.body.normal_equations(&posed, &residuals, &unknowns);
            equations.freeze_all_but(&unknowns);
            let delta = match is_constrained {
                false => equations.solve(DAMPING).map_err(|_| "its linear system is singular".to_string())?,
                true => {
                    let normals = problem.body_mesh(&posed).vertex_normals();
                    let rows =
                        rows_of_eq_6(&problem.body, &posed, &closest, &normals, &constrained(problem), &unknowns);
                    constrained_step(equations, rows)?
                }
            };
            let next = problem.body.stepped(&posed, &pose, &Shape(Vec::new()), &delta).0;
            let moved = problem.body.greatest_move(&posed, &posed.skeleton.joints_in_world(&next));
            pose = next;
            iterations += 1;
            on_step(&FitIteration { iteration: iterations, moved, residual, surface: &problem.mesh(&posed) });
            Ok::<_, String>(moved)
        });
        converged = settled.converged && settled.stopped.is_none();
        if let Some(reason) = settled.stopped {
            let equation = if is_constrained { "Eq. 6" } else { "Eq. 5" };
            log.push(format!("{equation} ended after {} steps: {reason}", settled.steps));
        }
    }
    PoseEstimate { pose, iterations, converged }
}

/// The selected part of the body: what the template covers.
fn constrained(problem: &InsideProblem<'_>) -> Vec<VertexId> {
    let figure = problem.figure_surface;
    (0..figure.body_count).map(VertexId::from_index).filter(|&v| figure.cover[v] != Cover::Bare).collect()
}

fn closest_points(surface: &ScanSurface, posed: &Posed) -> PerVertex<Point> {
    posed.points.0.par_iter().map(|p| surface.index.closest(p).point).collect::<Vec<_>>().into()
}

/// Three residuals per vertex, one per axis, all of weight 1; and the mean distance.
fn residuals_of_eq_5(posed: &Posed, closest: &PerVertex<Point>) -> (Vec<Residual>, f64) {
    let gaps: Vec<Vec3> = posed.points.iter().zip(closest.iter()).map(|(p, q)| q - p).collect();
    let mean = gaps.iter().map(Vec3::norm).sum::<f64>() / gaps.len().max(1) as f64;
    (gaps.iter().enumerate().flat_map(|(i, gap)| Residual::toward(i, *gap, 1.0)).collect(), mean)
}

/// `nᵢ · (corr(i) − Nᵢ(θ)) ≥ 0` for each constrained vertex, with the body's normal `nᵢ`.
fn rows_of_eq_6(
    body: &Articulated<'_>,
    posed: &Posed,
    closest: &PerVertex<Point>,
    body_normals: &PerVertex<Vec3>,
    constrained: &[VertexId],
    unknowns: &Unknowns,
) -> Vec<QpRow> {
    // Columns: translation, joints, then the shape coefficients of a model.
    let is_free = |column: usize| column < 3 || *unknowns.joints.get((column - 3) / 3).unwrap_or(&unknowns.shape);
    let row = |&v: &VertexId| {
        let normal = body_normals[v];
        let gradient = body.gradient(posed, &Residual::on_vertex(v, normal, 0.0, 1.0));
        let coefficients = gradient.into_iter().filter(|&(column, _)| is_free(column)).collect();
        QpRow { coefficients, bound: normal.dot(&(closest[v] - posed.points[v])), slack_weight: None }
    };
    constrained.iter().map(row).collect()
}

fn constrained_step(mut equations: NormalEquations, rows: Vec<QpRow>) -> Result<DVector<f64>, String> {
    equations.damp(DAMPING);
    let program = QuadraticProgram { quadratic: equations.h, linear: -equations.g, rows };
    let outcome = program.solve().map_err(|e| e.to_string())?;
    if !outcome.is_usable() {
        return Err(format!("no step satisfies the constraint (the quadratic program ended as {:?})", outcome.status));
    }
    Ok(DVector::from_vec(outcome.x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::embedded_model;
    use crate::scan::Scan;

    #[test]
    fn rows_use_the_bodys_normals_and_are_hard() {
        let model = embedded_model().unwrap();
        let body = Articulated::of_model(&model);
        let posed = body.posed(&Pose::bind(body.joint_count()), &model.mean_shape());
        // A scan whose surface is oblique to the body: moved sideways, so that closest points are not along normals.
        let scan = model.template.map_points(|p| p + Vec3::new(0.02, 0.0, 0.01));
        let surface = ScanSurface::prepare(&Scan::from_clean_mesh(scan, None));
        let closest = closest_points(&surface, &posed);
        let normals = model.template.with_points(posed.points.clone()).vertex_normals();
        let all: Vec<VertexId> = model.template.vertex_ids().step_by(50).collect();
        let unknowns = Unknowns { joints: vec![true; body.joint_count()], shape: false };
        let rows = rows_of_eq_6(&body, &posed, &closest, &normals, &all, &unknowns);
        assert_eq!(rows.len(), all.len(), "one row per constrained vertex, none gated");
        for (row, &v) in rows.iter().zip(&all) {
            assert_eq!(row.slack_weight, None);
            let by_translation: Vec<f64> =
                (0..3).map(|k| row.coefficients.iter().find(|c| c.0 == k).unwrap().1).collect();
            assert!((Vec3::from_column_slice(&by_translation) - normals[v]).norm() < 1e-6, "the body's normal");
            assert!((row.bound - normals[v].dot(&(closest[v] - posed.points[v]))).abs() < 1e-12, "no margin");
        }
    }

    #[test]
    fn every_vertex_counts_the_same() {
        let model = embedded_model().unwrap();
        let body = Articulated::of_model(&model);
        let posed = body.posed(&Pose::bind(body.joint_count()), &model.mean_shape());
        let far: PerVertex<Point> = posed.points.iter().map(|p| p + Vec3::new(0.0, 0.0, 0.5)).collect();
        let (residuals, mean) = residuals_of_eq_5(&posed, &far);
        assert_eq!(residuals.len(), 3 * posed.points.len());
        assert!(residuals.iter().all(|r| r.weight == 1.0) && (mean - 0.5).abs() < 1e-9);
    }

    #[test]
    fn a_constraint_that_cannot_be_satisfied_ends_the_fit() {
        let equations = || NormalEquations { h: nalgebra::DMatrix::identity(1, 1), g: DVector::zeros(1) };
        let row = |sign: f64| QpRow { coefficients: vec![(0, sign)], bound: -1.0, slack_weight: None };
        assert!(constrained_step(equations(), vec![row(1.0), row(-1.0)]).is_err());
        let step = constrained_step(equations(), vec![row(1.0)]).unwrap();
        assert!((step[0] + 1.0).abs() < 1e-6, "{}", step[0]);
    }
}
