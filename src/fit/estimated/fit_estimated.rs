//! One shape, and a pose in each scan of the dressed person.

use super::acceptance;
use super::deviation::along_normals;
use super::dressed_scan::DressedScan;
use super::dressed_view::DressedView;
use super::known::{KnownMeasure, measured};
use crate::body::{BodyModel, Pose, Shape};
use crate::fit::correspondence::{DownsampledModel, ScanSurface};
use crate::fit::error::{FitError, require_length};
use crate::fit::hands::Hands;
use crate::fit::naked::{CoarseFit, FINEST, FittedBody, NakedParams, NakedProblem, NakedReport, STILL, agreement};
use crate::fit::solver::{
    DAMPING, FitIteration, NormalEquations, Phase, Posed, Singular, StoppingRule, iterate, shape_information,
    solve_together,
};
use crate::geometry::{SurfaceIndex, VertexId};
use nalgebra::DMatrix;
use std::f64::consts::TAU;

/// A measure of the estimated body with its uncertainty, metres.
#[derive(Clone, Debug, PartialEq)]
pub struct UncertainGirth {
    /// As [`body_measures`](crate::body::body_measures) names it.
    pub name: String,
    /// Its value.
    pub metres: f64,
    /// Its standard deviation.
    pub deviation: f64,
}

/// A body estimated from scans of the dressed person.
#[derive(Clone, Debug)]
pub struct EstimatedBody {
    /// The body, posed in the first scan; its `poses_in_others` are those in the others.
    pub fitted: FittedBody,
    /// Covariance of β, after Laplace. **Shapes** K × K.
    pub covariance: DMatrix<f64>,
    /// Stature, girths and lengths.
    pub measures: Vec<UncertainGirth>,
}

/// What the model does not express of a measure: two bodies of the same coefficients differ by this much in metres, muscle and fat of
/// 2 mm around a limb, and by this share of a long measure.
const BEYOND_MODEL: f64 = 0.012;
const BEYOND_MODEL_SHARE: f64 = 0.008;

/// The deviation of a measure beyond the model.
fn beyond_model(value: f64) -> f64 {
    BEYOND_MODEL.hypot(BEYOND_MODEL_SHARE * value)
}

/// Estimates shape and poses from scans of the dressed person.
///
/// **Frame** each pose is in the world frame of its scan.
///
/// **Errors** [`FitError::EmptyScan`] without a scan or a surface, [`FitError::WrongLength`] for contacts of another model;
/// [`FitError::NotEstimated`] if a scan does not show one whole person in these clothes.
pub fn fit_estimated(
    scans: &[DressedScan<'_>],
    model: &BodyModel,
    known: &[KnownMeasure],
    params: &NakedParams,
    on_step: &mut dyn FnMut(&FitIteration),
) -> Result<EstimatedBody, FitError> {
    params.check()?;
    for dressed in scans {
        require_length("contacts, per vertex of the model", dressed.contact.len(), model.template.vertex_count())?;
    }
    if scans.is_empty() || scans.iter().any(|dressed| dressed.scan.mesh.face_count() == 0) {
        return Err(FitError::EmptyScan);
    }
    let downsampled = DownsampledModel::of(model)?;
    let index = SurfaceIndex::prepare(&model.template);
    let surfaces: Vec<ScanSurface> = scans.iter().map(|dressed| ScanSurface::prepare(dressed.scan)).collect();
    let mut log = Vec::new();
    let mut views = Vec::new();
    for (dressed, surface) in scans.iter().zip(&surfaces) {
        let problem = NakedProblem::prepare(model, index.clone(), surface, params);
        let initial = problem.best_initial_pose(&CoarseFit::prepare(&downsampled, surface, params), &mut log);
        views.push(DressedView::new(dressed, surface, model, index.clone(), initial.pose, params.samples)?);
    }
    let mut shape = model.mean_shape();
    let mut problem = Together { model, known, views };
    let (iterations, converged) = problem.refine(&mut shape, params, on_step);
    acceptance::check(&problem.views, model, &shape, params, !known.is_empty())?;
    problem.concluded(shape, iterations, converged, log)
}

/// What is known of the measures, taken at one shape, as it is at another: without this each step between two measurements would make
/// up for the same difference once more.
fn still_off(of_measures: &[(f64, f64, Vec<f64>)], at: &Shape, now: &Shape) -> Vec<(f64, f64, Vec<f64>)> {
    let change = |row: &[f64]| -> f64 { row.iter().zip(now.0.iter().zip(&at.0)).map(|(d, (b, a))| d * (b - a)).sum() };
    of_measures.iter().map(|(off, weight, row)| (off - change(row), *weight, row.clone())).collect()
}

struct Together<'a> {
    model: &'a BodyModel,
    known: &'a [KnownMeasure],
    views: Vec<DressedView<'a>>,
}

impl Together<'_> {
    fn refine(
        &mut self,
        shape: &mut Shape,
        params: &NakedParams,
        on_step: &mut dyn FnMut(&FitIteration),
    ) -> (usize, bool) {
        let phases = [
            Phase { iterations: 8, samples: 0, reach: 0.10, least_cosine: 0.4, limbs_only: false, shape: true },
            Phase { iterations: 8, samples: 0, reach: 0.06, least_cosine: 0.5, limbs_only: false, shape: true },
            Phase { iterations: params.iterations, samples: 0, ..FINEST },
        ];
        let (mut iterations, mut converged) = (0, false);
        for phase in phases {
            let (mut of_measures, mut measured_at) = (self.of_known(shape), shape.clone());
            let rule = StoppingRule { steps: phase.iterations, still: STILL, still_steps: 2, first_still: 0 };
            let settled = iterate(&rule, |number| {
                if number % 4 == 3 {
                    (of_measures, measured_at) = (self.of_known(shape), shape.clone());
                }
                let of_measures = still_off(&of_measures, &measured_at, shape);
                let posed: Vec<Posed> = self.views.iter_mut().map(|view| view.posed(shape)).collect();
                self.views.iter_mut().for_each(DressedView::fit_ease);
                let parts = self.parts(&posed, &phase, &of_measures);
                let steps = solve_together(&parts, shape, 1.0, DAMPING)?;
                let mut moved: f64 = 0.0;
                let mut next = shape.clone();
                for ((view, posed), step) in self.views.iter_mut().zip(&posed).zip(&steps) {
                    let (pose, changed) = view.body.stepped(posed, &view.pose, shape, step);
                    let after = self.model.skeleton_of(&changed).joints_in_world(&pose);
                    moved = moved.max(view.body.greatest_move(posed, &after));
                    (view.pose, next) = (pose, changed);
                }
                *shape = next;
                iterations += 1;
                let surface = self.views[0].index().mesh();
                on_step(&FitIteration { iteration: iterations, moved, residual: 0.0, surface });
                Ok::<_, Singular>(moved)
            });
            converged = settled.converged;
        }
        (iterations, converged)
    }

    fn parts(&self, posed: &[Posed], phase: &Phase, of_measures: &[(f64, f64, Vec<f64>)]) -> Vec<NormalEquations> {
        let mut parts: Vec<NormalEquations> =
            self.views.iter().zip(posed).map(|(view, posed)| view.equations(posed, phase)).collect();
        let first = &mut parts[0];
        for (off, weight, row) in of_measures {
            let at = first.g.len() - row.len();
            for (i, a) in row.iter().enumerate() {
                first.g[at + i] += weight * off * a;
                for (j, b) in row.iter().enumerate() {
                    first.h[(at + i, at + j)] += weight * a * b;
                }
            }
        }
        parts
    }

    /// What is known of the measures: how far off, weight, derivative by β.
    fn of_known(&self, shape: &Shape) -> Vec<(f64, f64, Vec<f64>)> {
        if self.known.is_empty() {
            return Vec::new();
        }
        let at = measured(self.model, shape);
        let of = |known: &KnownMeasure| {
            let row = at.row(&known.name)?;
            let deviation = known.deviation.hypot(beyond_model(known.value));
            Some((known.value - at.values[row], deviation.powi(-2), at.by_shape.row(row).iter().copied().collect()))
        };
        self.known.iter().filter_map(of).collect()
    }

    fn concluded(
        mut self,
        shape: Shape,
        iterations: usize,
        converged: bool,
        mut log: Vec<String>,
    ) -> Result<EstimatedBody, FitError> {
        let phase = Phase { samples: 0, ..FINEST };
        let posed: Vec<Posed> = self.views.iter_mut().map(|view| view.posed(&shape)).collect();
        let of_measures = self.of_known(&shape);
        let information = shape_information(&self.parts(&posed, &phase, &of_measures), shape.0.len(), 1.0)
            .map_err(|Singular| FitError::Singular { reason: "the information about the shape is singular".into() })?;
        let covariance = information.cholesky().map(|c| c.inverse()).unwrap_or_else(|| {
            let k = shape.0.len();
            DMatrix::identity(k, k)
        });
        let at = measured(self.model, &shape);
        let measures = (at.names.iter().enumerate())
            .map(|(m, name)| {
                let row = at.by_shape.row(m);
                let variance = (row * &covariance * row.transpose())[(0, 0)];
                let deviation = variance.sqrt().hypot(beyond_model(at.values[m]));
                UncertainGirth { name: name.clone(), metres: at.values[m], deviation }
            })
            .collect();
        let (surface, skeleton) = self.model.shaped(&shape);
        let first = &self.views[0];
        let agreement = agreement(first.index(), first.surface);
        let (residual_mean, residual_p95) = first.residual_of_skin();
        let mut pose: Pose = first.pose.clone();
        let is_bare = |v: VertexId| first.is_skin(v);
        let hands = Hands {
            mesh: &surface,
            weights: &self.model.weights,
            skeleton: &skeleton,
            is_bare: &is_bare,
            turns_wrists: true,
        };
        log.extend(hands.fit(first.surface, &mut pose, &[]));
        let report = NakedReport {
            converged,
            iterations,
            residual_mean,
            residual_p95,
            confidence: agreement.confidence(),
            explained_share: agreement.explained,
            seen_share: agreement.seen,
            head_is_seen: true,
            log,
        };
        let poses_in_others = self.views[1..].iter().map(|view| Some(view.pose.clone())).collect();
        let deviation = Some(along_normals(self.model, &surface, &covariance, BEYOND_MODEL / TAU));
        let unseen = Vec::new();
        let fitted =
            FittedBody { shape, pose, surface, skeleton, unseen, poses_in_others, deviation, report, hair: None };
        Ok(EstimatedBody { fitted, covariance, measures })
    }
}
