//! The Gauss–Newton step under the constraint of Eq. 6: a quadratic program.

use super::params::InsideMethod;
use super::problem::InsideProblem;
use crate::fit::correspondence::Sidedness;
use crate::fit::solver::{NormalEquations, Posed, Residual, Singular};
use crate::geometry::{PerVertex, Vec3, VertexId};
use crate::numerics::{QpRow, QuadraticProgram};
use nalgebra::DVector;

impl InsideProblem<'_> {
    /// The Gauss–Newton step that keeps every hidden vertex inside by the margin: Eq. 6, with slack.
    pub(super) fn constrained_step(
        &self,
        posed: &Posed,
        normals: &PerVertex<Vec3>,
        equations: NormalEquations,
        log: &mut Vec<String>,
    ) -> Result<DVector<f64>, Singular> {
        /// One step cannot move a vertex with more clearance than this outside. Metres.
        const NEAR: f64 = 0.03;
        /// Cost per metre outside and vertex: greater than the pull of the data on one vertex (200 for a residual of 5 mm on one
        /// observation), so that slack is used only if nothing else is possible.
        const SLACK_WEIGHT: f64 = 4e3;
        let sides = self.sides(posed, normals);
        let slack_weight = Some(SLACK_WEIGHT * self.constraint_weight(&sides));
        let is_free = |column: usize| column < 3 || !self.held[(column - 3) / 3];
        let rows = sides
            .into_iter()
            .enumerate()
            .filter_map(|(i, side)| side.filter(|s| s.clearance < NEAR).map(|s| (VertexId::from_index(i), s)))
            .map(|(v, side)| {
                let row = self.body.gradient(posed, &Residual::on_vertex(v, side.normal, 0.0, 1.0));
                let coefficients = row.into_iter().filter(|&(column, _)| is_free(column)).collect();
                QpRow { coefficients, bound: side.clearance - self.pose_margin(v), slack_weight }
            })
            .collect();
        let fallback = equations.solve(0.0);
        let program = QuadraticProgram { quadratic: equations.h, linear: -equations.g, rows };
        match program.solve() {
            Ok(outcome) if outcome.is_usable() => Ok(DVector::from_vec(outcome.x)),
            Ok(outcome) => {
                log.push(format!(
                    "the quadratic program ended as {:?}; this step ignores the constraint",
                    outcome.status
                ));
                fallback
            }
            Err(e) => {
                log.push(format!("the quadratic program is invalid: {e}; this step ignores the constraint"));
                fallback
            }
        }
    }

    /// Weight of the constraint: 1 if few hidden vertices are too far outside for the offset, less the more there are. No pose
    /// brings in a trunk that is too thick all around, and all of its vertices together would turn legs away from their data.
    fn constraint_weight(&self, sides: &[Option<Sidedness>]) -> f64 {
        /// Share of the vertices: 0.1 % at the end of fits of the right person.
        const FEW: f64 = 0.02;
        if self.params.method == InsideMethod::Hybrid || !self.params.method.is_weighted() {
            return 1.0;
        }
        let violation = |(v, side): (usize, &Sidedness)| self.pose_margin(VertexId::from_index(v)) - side.clearance;
        let seen = || sides.iter().enumerate().filter_map(|(v, side)| Some((v, side.as_ref()?)));
        let outside = seen().filter(|at| violation(*at) > self.params.greatest_offset).count() as f64;
        (FEW * seen().count() as f64 / outside.max(1.0)).min(1.0)
    }
}
