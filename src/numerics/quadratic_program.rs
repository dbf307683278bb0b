//! Convex quadratic programs with many linear bounds on few unknowns.

use super::NumericsError;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus};
use nalgebra::{DMatrix, DVector};

/// Greatest number of rows added per round. Active sets have about as many rows as there are unknowns (100); a few hundred rows
/// are solved in milliseconds, ten thousand in a second.
const ROWS_PER_ROUND: usize = 300;
/// Rounds before all rows are added at once.
const ROUNDS: usize = 30;
/// A row counts as violated above this share of its own size: the accuracy of the inner solver.
const TOLERANCE: f64 = 1e-8;
/// Greatest number of interior point steps; ten to twenty usually suffice.
const STEPS: u32 = 200;

/// Minimise `½ xᵀPx + qᵀx` subject to rows `aᵀx ≤ bound`.
///
/// **Shapes** `P` is `n × n`, symmetric positive semidefinite (the upper triangle is read); `q` is `n`.
#[derive(Clone, Debug)]
pub struct QuadraticProgram {
    /// `P`. **Shapes** `n × n`.
    pub quadratic: DMatrix<f64>,
    /// `q`. **Shapes** `n`.
    pub linear: DVector<f64>,
    /// The bounds.
    pub rows: Vec<QpRow>,
}

/// One bound, `aᵀx ≤ bound + slack`.
#[derive(Clone, Debug, PartialEq)]
pub struct QpRow {
    /// The nonzero entries of `a`: (unknown, value).
    pub coefficients: Vec<(usize, f64)>,
    /// The right-hand side.
    pub bound: f64,
    /// `None`: the bound is hard. `Some(w)`: exceeding it costs `w` per unit (an exact penalty: with `w` above the row's
    /// multiplier it is exceeded only if the program is otherwise infeasible).
    pub slack_weight: Option<f64>,
}

/// How the solver ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QpStatus {
    /// To full accuracy.
    Solved,
    /// To reduced accuracy.
    AlmostSolved,
    /// No point satisfies all rows without slack.
    Infeasible,
    /// The objective is unbounded below.
    Unbounded,
    /// The solver did not converge; `x` is its last iterate.
    NotConverged,
}

/// The result of a quadratic program.
#[derive(Clone, Debug)]
pub struct QpOutcome {
    /// The minimiser, one entry per unknown; valid if [`is_usable`](Self::is_usable).
    pub x: Vec<f64>,
    /// By how much each row is exceeded; zero for satisfied rows. **Shapes** one value per row.
    pub slack: Vec<f64>,
    /// The Lagrange multiplier of each row, ≥ 0. **Shapes** one value per row.
    pub multipliers: Vec<f64>,
    /// How the solver ended.
    pub status: QpStatus,
    /// Interior point steps over all rounds.
    pub steps: usize,
}

impl QpOutcome {
    /// Whether `x` solves the program.
    pub fn is_usable(&self) -> bool {
        matches!(self.status, QpStatus::Solved | QpStatus::AlmostSolved)
    }
}

impl QuadraticProgram {
    /// Solves the program. Non-convergence is an outcome; only inconsistent arrays are an error.
    ///
    /// Rows are added when they are violated: a point that satisfies all rows and is optimal for some of them is optimal.
    ///
    /// **Guarantees** deterministic.
    pub fn solve(&self) -> Result<QpOutcome, NumericsError> {
        self.check()?;
        let mut working: Vec<usize> = Vec::new();
        let mut taken = vec![false; self.rows.len()];
        let mut steps = 0;
        let mut round = 0;
        loop {
            if round == ROUNDS || (round == 0 && self.rows.len() <= ROWS_PER_ROUND) {
                working = (0..self.rows.len()).collect();
            }
            let complete = working.len() == self.rows.len();
            let mut outcome = self.solve_rows(&working);
            steps += outcome.steps;
            outcome.steps = steps;
            let violated = match outcome.status {
                QpStatus::Solved | QpStatus::AlmostSolved => self.most_violated(&outcome.x, &taken),
                // If some rows cannot be satisfied, all cannot.
                QpStatus::Infeasible => Vec::new(),
                // Other rows may bound the objective.
                QpStatus::Unbounded | QpStatus::NotConverged => (0..self.rows.len()).filter(|&i| !taken[i]).collect(),
            };
            if complete || violated.is_empty() {
                return Ok(outcome);
            }
            violated.iter().for_each(|&i| taken[i] = true);
            working.extend(violated);
            working.sort_unstable();
            round += 1;
        }
    }

    fn check(&self) -> Result<(), NumericsError> {
        let n = self.linear.len();
        for (what, given) in [("rows of P", self.quadratic.nrows()), ("columns of P", self.quadratic.ncols())] {
            if given != n {
                return Err(NumericsError::WrongLength { what, given, expected: n });
            }
        }
        if let Some(index) = self.quadratic.iter().position(|v| !v.is_finite()) {
            return Err(NumericsError::NotFinite { what: "P", index });
        }
        if let Some(index) = self.linear.iter().position(|v| !v.is_finite()) {
            return Err(NumericsError::NotFinite { what: "q", index });
        }
        for (index, row) in self.rows.iter().enumerate() {
            if let Some(&(column, _)) = row.coefficients.iter().find(|c| c.0 >= n) {
                return Err(NumericsError::OutOfRange { row: index, column, size: n });
            }
            let weight = row.slack_weight.unwrap_or(0.0);
            if !row.bound.is_finite() || !weight.is_finite() || row.coefficients.iter().any(|c| !c.1.is_finite()) {
                return Err(NumericsError::NotFinite { what: "rows", index });
            }
        }
        Ok(())
    }

    /// The rows not yet added that `x` violates most, each on its own scale.
    fn most_violated(&self, x: &[f64], taken: &[bool]) -> Vec<usize> {
        let mut violated: Vec<(f64, usize)> = (0..self.rows.len())
            .filter(|&i| !taken[i])
            .map(|i| (self.rows[i].excess(x) / self.rows[i].scale(), i))
            .filter(|&(excess, _)| excess > TOLERANCE)
            .collect();
        violated.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        violated.truncate(ROWS_PER_ROUND);
        violated.into_iter().map(|(_, i)| i).collect()
    }

    /// Solves the program with some of its rows by clarabel.
    fn solve_rows(&self, working: &[usize]) -> QpOutcome {
        let n = self.linear.len();
        let soft: Vec<(usize, f64)> = working
            .iter()
            .enumerate()
            .filter_map(|(at, &i)| self.rows[i].slack_weight.map(|weight| (at, weight)))
            .collect();
        let size = n + soft.len();

        let upper = (0..n).flat_map(|j| (0..=j).map(move |i| (i, j))).filter(|&(i, j)| self.quadratic[(i, j)] != 0.0);
        let (rows, columns): (Vec<usize>, Vec<usize>) = upper.unzip();
        let values = rows.iter().zip(&columns).map(|(&i, &j)| self.quadratic[(i, j)]).collect();
        let quadratic = CscMatrix::new_from_triplets(size, size, rows, columns, values);

        // The rows as they are, then slack ≥ 0.
        let (mut rows, mut columns, mut values) = (Vec::new(), Vec::new(), Vec::new());
        let mut push = |row: usize, column: usize, value: f64| {
            rows.push(row);
            columns.push(column);
            values.push(value);
        };
        for (at, &i) in working.iter().enumerate() {
            self.rows[i].coefficients.iter().for_each(|&(column, value)| push(at, column, value));
        }
        for (k, &(at, _)) in soft.iter().enumerate() {
            push(at, n + k, -1.0);
            push(working.len() + k, n + k, -1.0);
        }
        let constraints = CscMatrix::new_from_triplets(working.len() + soft.len(), size, rows, columns, values);
        let mut bounds: Vec<f64> = working.iter().map(|&i| self.rows[i].bound).collect();
        bounds.resize(working.len() + soft.len(), 0.0);
        let mut linear = self.linear.as_slice().to_vec();
        linear.extend(soft.iter().map(|s| s.1));

        let settings =
            DefaultSettings { verbose: false, max_iter: STEPS, max_threads: 1, ..DefaultSettings::default() };
        let cones = [NonnegativeConeT(bounds.len())];
        let mut outcome = QpOutcome {
            x: vec![0.0; n],
            slack: vec![0.0; self.rows.len()],
            multipliers: vec![0.0; self.rows.len()],
            status: QpStatus::NotConverged,
            steps: 0,
        };
        let Ok(mut solver) = DefaultSolver::new(&quadratic, &linear, &constraints, &bounds, &cones, settings) else {
            return outcome;
        };
        solver.solve();
        let solution = &solver.solution;
        outcome.status = match solution.status {
            SolverStatus::Solved => QpStatus::Solved,
            SolverStatus::AlmostSolved => QpStatus::AlmostSolved,
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => QpStatus::Infeasible,
            SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => QpStatus::Unbounded,
            _ => QpStatus::NotConverged,
        };
        outcome.steps = solution.iterations as usize;
        if solution.x.iter().all(|v| v.is_finite()) {
            outcome.x.copy_from_slice(&solution.x[..n]);
        }
        for (at, &i) in working.iter().enumerate() {
            outcome.multipliers[i] = solution.z[at].max(0.0);
        }
        for &(at, _) in &soft {
            let row = &self.rows[working[at]];
            let excess = row.excess(&outcome.x);
            outcome.slack[working[at]] = if excess > TOLERANCE * row.scale() { excess } else { 0.0 };
        }
        outcome
    }
}

impl QpRow {
    /// `aᵀx − bound`.
    ///
    /// **Shapes** `x` has one entry per unknown.
    pub fn excess(&self, x: &[f64]) -> f64 {
        self.coefficients.iter().map(|&(i, value)| value * x[i]).sum::<f64>() - self.bound
    }

    fn scale(&self) -> f64 {
        let squared: f64 = self.coefficients.iter().map(|c| c.1 * c.1).sum();
        squared.sqrt().max(self.bound.abs()).max(f64::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed | 1;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    fn random(n: usize, rows: usize, seed: u64, slack_weight: Option<f64>) -> QuadraticProgram {
        let mut next = noise(seed);
        let root = DMatrix::from_fn(n, n, |_, _| next());
        QuadraticProgram {
            quadratic: root.transpose() * &root + DMatrix::identity(n, n) * 0.1,
            linear: DVector::from_fn(n, |_, _| 5.0 * next()),
            rows: (0..rows)
                .map(|_| QpRow {
                    coefficients: (0..n).map(|i| (i, next())).collect(),
                    bound: next() + 0.5,
                    slack_weight,
                })
                .collect(),
        }
    }

    /// Stationary, feasible, complementary: then `x` is the minimiser, by convexity.
    fn assert_optimal(program: &QuadraticProgram, outcome: &QpOutcome) {
        assert_eq!(outcome.status, QpStatus::Solved);
        let x = DVector::from_column_slice(&outcome.x);
        let mut gradient = &program.quadratic * &x + &program.linear;
        for (i, row) in program.rows.iter().enumerate() {
            let (z, excess) = (outcome.multipliers[i], row.excess(&outcome.x));
            row.coefficients.iter().for_each(|&(j, value)| gradient[j] += z * value);
            match row.slack_weight {
                None => assert!(excess < 1e-6 && outcome.slack[i] == 0.0),
                Some(weight) => {
                    assert!(z < weight + 1e-5);
                    assert!(outcome.slack[i] < 1e-6 || (z - weight).abs() < 1e-4, "slack is paid for in full");
                    assert!((outcome.slack[i] - excess.max(0.0)).abs() < 1e-6);
                }
            }
            assert!(z * (outcome.slack[i] - excess).abs() < 1e-4, "row {i}: multiplier {z}, room {excess}");
        }
        assert!(gradient.amax() < 1e-4, "{}", gradient.amax());
    }

    #[test]
    fn optimal_by_karush_kuhn_tucker_with_few_rows_and_with_many() {
        for (n, rows, seed) in [(3, 5, 1), (10, 40, 2), (20, 1500, 3)] {
            let mut program = random(n, rows, seed, None);
            // A hard random program of many rows need not be feasible; around the origin it is.
            program.rows.iter_mut().for_each(|row| row.bound = row.bound.abs() + 0.1);
            let outcome = program.solve().unwrap();
            assert_optimal(&program, &outcome);
            assert!(outcome.multipliers.iter().any(|&z| z > 1e-3), "some row must bind for the test to mean anything");
            assert_optimal(
                &random(n, rows, seed + 10, Some(3.0)),
                &random(n, rows, seed + 10, Some(3.0)).solve().unwrap(),
            );
        }
    }

    #[test]
    fn what_is_infeasible_is_said_and_slack_makes_it_feasible() {
        let one = |slack_weight| QuadraticProgram {
            quadratic: DMatrix::identity(1, 1),
            linear: DVector::zeros(1),
            rows: vec![
                QpRow { coefficients: vec![(0, 1.0)], bound: -1.0, slack_weight },
                QpRow { coefficients: vec![(0, -1.0)], bound: -1.0, slack_weight: None },
            ],
        };
        assert_eq!(one(None).solve().unwrap().status, QpStatus::Infeasible);
        let outcome = one(Some(10.0)).solve().unwrap();
        assert!((outcome.x[0] - 1.0).abs() < 1e-6 && (outcome.slack[0] - 2.0).abs() < 1e-6);
        assert_eq!(outcome.slack[1], 0.0);
    }

    #[test]
    fn no_rows_no_bound_and_what_has_no_end_is_said() {
        let free = random(5, 0, 4, None);
        let outcome = free.solve().unwrap();
        let gradient = &free.quadratic * DVector::from_column_slice(&outcome.x) + &free.linear;
        assert!(gradient.amax() < 1e-6);
        let endless =
            QuadraticProgram { quadratic: DMatrix::zeros(1, 1), linear: DVector::from_element(1, 1.0), rows: vec![] };
        assert!(!endless.solve().unwrap().is_usable());
    }

    #[test]
    fn arrays_that_disagree_are_an_error() {
        let mut program = random(3, 2, 5, None);
        program.rows[1].coefficients.push((3, 1.0));
        assert_eq!(program.solve().err(), Some(NumericsError::OutOfRange { row: 1, column: 3, size: 3 }));
        let mut program = random(3, 2, 5, None);
        program.rows[0].bound = f64::NAN;
        assert_eq!(program.solve().err(), Some(NumericsError::NotFinite { what: "rows", index: 0 }));
    }
}
