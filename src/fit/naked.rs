//! The naked scan: Hu 2017, Eq. 4, by articulated ICP.

use super::articulated::{Articulated, Posed, Residual};
use super::bent_arms::{buried_hand, doubtful_arms, forearms_are_seen, with_bent_arms, with_trunk_straight};
use super::limbs::{self, Part};
use super::normal_equations::{NormalEquations, PosePrior, Unknowns};
use super::prior::pose_stiffness;
use super::starts::{Start, headings, with_arms_as_they_are, with_other_arms};
use super::surface::{LastFaces, ScanSurface, mean_gap, mean_truncated, robust, scan_to_mesh_from, spread};
use super::thinned::{ThinModel, Thinned};
use super::trust::{self, Agreement};
use super::{FitError, FitReport, FittedBody, ShapeFrom, Step};
use crate::body::{BodyModel, JointId, Pose, Shape};
use crate::geometry::{PerVertex, SurfaceIndex, TriMesh, Vec3, VertexId};
use crate::scan::Scan;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How the naked scan is fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NakedParams {
    /// Places on the model and on the scan that take part in the last, finest iterations.
    pub samples: usize,
    /// Iterations of the finest stage at most.
    pub iterations: usize,
    /// Strength of the shape prior `|β|²` against residuals in units of 5 mm, one a 4 cm².
    pub shape_prior: f64,
    /// Strength of the pose prior on the same scale.
    pub pose_prior: f64,
    /// Greatest mean distance of the scan to the model, in metres, at which the result is taken for a body. A scan of
    /// a person in a coat fits a naked model to about 30 mm; chairs and dogs to more than 50.
    pub refuse_above: f64,
    /// Least share of the scan's surface that the body must explain: 0.98 and more on whole persons, invented and foreign;
    /// an arm in a pose that was not found, or a chair beside the person, is a tenth of the surface.
    pub least_explained: f64,
    /// Greatest distance of a shape coefficient from the model's mean, in standard deviations: grown-ups stay below 3.5.
    pub greatest_deviation: f64,
    /// Whether a limb that is not seen is taken for missing though something in the scan may be it.
    pub missing_limbs: bool,
    /// Which scans make the shape.
    pub shape_from: ShapeFrom,
}

impl Default for NakedParams {
    fn default() -> Self {
        Self {
            samples: 6000,
            iterations: 30,
            shape_prior: 4.0,
            pose_prior: 20.0,
            refuse_above: 0.035,
            least_explained: 0.93,
            greatest_deviation: 5.0,
            missing_limbs: false,
            shape_from: ShapeFrom::Naked,
        }
    }
}

/// One round of iterations with fixed gates.
pub(crate) struct Stage {
    pub(crate) iterations: usize,
    pub(crate) samples: usize,
    /// Correspondences further apart are ignored; metres.
    pub(crate) reach: f64,
    /// Normals at a greater angle do not match.
    pub(crate) least_cosine: f64,
    /// Only root, shoulders, hips and knees turn.
    pub(crate) limbs_only: bool,
    pub(crate) shape: bool,
}

/// The gates of the last iterations, at correspondences that are nearly all right.
pub(super) const FINEST: Stage =
    Stage { iterations: 30, samples: 6000, reach: 0.035, least_cosine: 0.6, limbs_only: false, shape: true };

/// Fits shape and pose to a scan of the naked body, whatever its heading and wherever its arms are.
///
/// **Frame** the result's pose is in the scan's world frame.
///
/// **Guarantees** limbs that the scan does not show are named in the report and take the pose of the other side; the
/// report's confidence is the share of the scan that the body explains times the share of the body that the scan shows.
///
/// **Errors** [`FitError::NotABody`], [`FitError::Unexplained`], [`FitError::LimbNotFound`],
/// [`FitError::HalfABody`] and [`FitError::FarFromModel`] where no start leads to a
/// body that explains the scan.
pub fn fit_naked(
    scan: &Scan,
    model: &BodyModel,
    params: &NakedParams,
    on_step: &mut dyn FnMut(&Step),
) -> Result<FittedBody, FitError> {
    if scan.mesh.face_count() == 0 {
        return Err(FitError::EmptyScan);
    }
    let of_model = || (ThinModel::of(model), SurfaceIndex::prepare(&model.template));
    let (surface, (thin, index)) = rayon::join(|| ScanSurface::prepare(scan), of_model);
    let mut solver = Solver::prepare(model, index, &surface, params);
    let mut log = Vec::new();

    let thinned = Thinned::prepare(&thin, &surface, params);
    let start = solver.best_start(&thinned, &mut log);
    let mut found = solver.refine(start.pose, start.shape, on_step);
    let mut index = solver.index_at(&found.pose, &found.shape);
    let doubtful = doubtful_arms(&solver, &index);
    if !doubtful.is_empty() {
        found = with_bent_arms(&solver, &thinned, &found, &doubtful, &mut log).unwrap_or(found);
        index = solver.index_at(&found.pose, &found.shape);
    }
    let unseen = limbs::unseen(&index, &solver.parts, &model.skeleton, &surface);
    if !unseen.is_empty() {
        found = solver.without(&unseen, found, &mut log, on_step);
        index = solver.index_at(&found.pose, &found.shape);
    }

    solver.conclude(found, &index, unseen, log)
}

fn refuse_what_is_no_body(
    model: &BodyModel,
    params: &NakedParams,
    residual: f64,
    agreement: &Agreement,
    found: &Found,
    unseen: &[JointId],
    buried: Option<&str>,
) -> Result<(), FitError> {
    // What shows a body besides other things is told of by their share: an average over both says nothing of either.
    const MOSTLY_A_BODY: f64 = 0.5;
    if residual > params.refuse_above && !(MOSTLY_A_BODY..params.least_explained).contains(&agreement.explained) {
        return Err(FitError::NotABody { residual_mm: residual * 1e3, limit_mm: params.refuse_above * 1e3 });
    }
    // A child is fitted nearly, by a body that is none: what is wrong is the model, not the scan.
    const NEARLY: f64 = 0.85;
    let deviation = found.shape.0.iter().fold(0.0_f64, |most, beta| most.max(beta.abs()));
    let far = (deviation > params.greatest_deviation)
        .then_some(FitError::FarFromModel { deviation, limit: params.greatest_deviation });
    if let (Some(far), true) = (&far, agreement.explained > NEARLY) {
        return Err(far.clone());
    }
    if agreement.explained < params.least_explained {
        let near = agreement.most_unexplained(&model.weights, &model.skeleton).map(|(part, _)| part);
        return Err(FitError::Unexplained {
            percent: (1.0 - agreement.explained) * 100.0,
            limit_percent: (1.0 - params.least_explained) * 100.0,
            near: near.unwrap_or_else(|| "body".into()),
        });
    }
    // What is left of the scan where a limb was not found is that limb, in a pose that was not.
    // Missing limbs left 0.1 % on invented people, crossed arms 2 to 2.5 %.
    const LIMB: f64 = 0.015;
    let is_elsewhere = !params.missing_limbs && 1.0 - agreement.explained > LIMB;
    if let (Some(limb), true) = (unseen.first(), is_elsewhere) {
        return Err(FitError::LimbNotFound {
            limb: limbs::spoken(&model.skeleton.names[limb.index()]),
            what: format!(
                "and {:.0} % of the scan's surface is no part of the body",
                (1.0 - agreement.explained) * 100.0
            ),
        });
    }
    if let (Some(hand), false) = (buried, params.missing_limbs) {
        return Err(FitError::LimbNotFound { limb: limbs::spoken(hand), what: "inside the body".into() });
    }
    if let Some(region) = agreement.missing_region(&model.weights, &model.skeleton) {
        return Err(FitError::HalfABody { region: region.into(), seen_percent: agreement.seen * 100.0 });
    }
    far.map_or(Ok(()), Err)
}

/// What the iterations came to.
pub(super) struct Found {
    pub(super) pose: Pose,
    pub(super) shape: Shape,
    pub(super) iterations: usize,
    pub(super) converged: bool,
}

impl Found {
    /// What an earlier fit came to.
    pub(super) fn at(fitted: &FittedBody) -> Self {
        let FittedBody { pose, shape, report, .. } = fitted;
        let (pose, shape) = (pose.clone(), shape.clone());
        Self { pose, shape, iterations: report.iterations, converged: report.converged }
    }
}

/// A start that leaves more is looked for further: right ones leave 2 to 4 mm, wrong ones 10 and more. Metres.
const GOOD_START: f64 = 0.006;

/// A joint moved less than this in a step, in metres: far below the scan's noise.
pub(super) const STILL: f64 = 3e-4;
/// The same where finer gates follow, which move joints by 2 mm anew.
const NEARLY_STILL: f64 = 1e-3;

/// Places that take part in an iteration, each with the area that it stands for.
pub(super) struct Places {
    model: Vec<(VertexId, f64)>,
    scan: Vec<(VertexId, f64)>,
    near_model: LastFaces,
    near_scan: LastFaces,
}

pub(super) struct Solver<'a> {
    pub(super) body: Articulated<'a>,
    pub(super) model: &'a BodyModel,
    pub(super) surface: &'a ScanSurface,
    params: &'a NakedParams,
    parts: Vec<Part>,
    /// The model in the bind pose: a hierarchy of its faces that follows it through poses.
    pub(super) index: SurfaceIndex,
    /// Joints that keep their pose, for the scan does not show what they move.
    held: Vec<bool>,
    /// Vertices that take no part, for the same reason.
    left_out: PerVertex<bool>,
    /// Where the pose prior draws.
    center: Pose,
}

impl<'a> Solver<'a> {
    /// `index` holds the model in the bind pose.
    pub(super) fn prepare(
        model: &'a BodyModel,
        index: SurfaceIndex,
        surface: &'a ScanSurface,
        params: &'a NakedParams,
    ) -> Self {
        let body = Articulated::of_model(model);
        let joints = body.joint_count();
        Self {
            parts: limbs::parts(&model.skeleton, &model.weights),
            index,
            held: vec![false; joints],
            left_out: PerVertex::filled(false, model.template.vertex_count()),
            center: Pose::bind(joints),
            body,
            model,
            surface,
            params,
        }
    }

    /// The best of several headings and arms: front from back shows only in feet and face, so whole surfaces decide.
    fn best_start(&self, thinned: &Thinned<'_>, log: &mut Vec<String>) -> Start {
        let scored = |starts: Vec<Start>| -> Vec<Start> {
            starts.into_par_iter().map(|s| Start { score: self.score(&s.pose, &s.shape), ..s }).collect()
        };
        let best_first = |a: &Start, b: &Start| a.score.total_cmp(&b.score);
        let rough = headings(self.model, self.surface, thinned, true);
        let mut finals = scored(with_arms_as_they_are(thinned, &rough));
        finals.sort_by(best_first);
        // Who stands as asked is found by now; other arms are tried where it does not look so.
        if finals[0].score > GOOD_START || !forearms_are_seen(self, &finals[0]) {
            let fine = headings(self.model, self.surface, thinned, false);
            finals.extend(scored(with_other_arms(self.model, thinned, fine)));
            finals.sort_by(best_first);
        }
        for s in &finals {
            log.push(format!("start at {}: score {:.1} mm", s.name, s.score * 1e3));
        }
        finals.swap_remove(0)
    }

    pub(super) fn refine(&self, pose: Pose, shape: Shape, on_step: &mut dyn FnMut(&Step)) -> Found {
        let n = self.params.samples;
        let stages = [
            Stage { iterations: 5, samples: n / 3, reach: 0.10, least_cosine: 0.4, limbs_only: false, shape: true },
            Stage { iterations: 5, samples: n / 2, reach: 0.06, least_cosine: 0.5, limbs_only: false, shape: true },
            Stage { iterations: self.params.iterations, samples: n, ..FINEST },
        ];
        let mut found = Found { pose, shape, iterations: 0, converged: false };
        let mut index = self.index.clone();
        for stage in &stages {
            self.run(stage, &mut found, &mut index, on_step);
        }
        found
    }

    /// What was found, which `index` holds, with its report, or why it is no body.
    pub(super) fn conclude(
        &self,
        found: Found,
        index: &SurfaceIndex,
        unseen: Vec<JointId>,
        mut log: Vec<String>,
    ) -> Result<FittedBody, FitError> {
        let model = self.model;
        let agreement = trust::agreement(index, self.surface);
        let (residual_mean, residual_p95) = agreement.residual;
        let buried = buried_hand(self, index, &unseen);
        refuse_what_is_no_body(model, self.params, residual_mean, &agreement, &found, &unseen, buried)?;
        log.extend(trust::what_is_unexplained(&agreement, &model.weights, &model.skeleton));
        log.extend(self.unseen_head(index));
        if !found.converged {
            log.push(format!("not converged after {} iterations: look at the result", found.iterations));
        }
        let (surface, skeleton) = model.shaped(&found.shape);
        let report = FitReport {
            converged: found.converged,
            iterations: found.iterations,
            residual_mean,
            residual_p95,
            confidence: agreement.confidence(),
            explained_share: agreement.explained,
            seen_share: agreement.seen,
            log,
            ..FitReport::default()
        }
        .doubted();
        let Found { shape, pose, .. } = found;
        Ok(FittedBody { shape, pose, surface, skeleton, unseen, elsewhere: Vec::new(), report })
    }

    pub(super) fn index_at(&self, pose: &Pose, shape: &Shape) -> SurfaceIndex {
        let mut index = self.index.clone();
        index.follow(&self.mesh(&self.body.posed(pose, shape)));
        index
    }

    pub(super) fn mesh(&self, posed: &Posed) -> TriMesh {
        self.model.template.with_points(posed.points.clone())
    }

    /// A sentence where the scan lacks the head, without which all the rest is fitted as well.
    fn unseen_head(&self, index: &SurfaceIndex) -> Option<String> {
        let (skeleton, weights) = (&self.model.skeleton, &self.model.weights);
        let head = limbs::parts_named(&["head"], skeleton, weights);
        let unseen = limbs::unseen(index, &head, skeleton, self.surface);
        (!unseen.is_empty()).then(|| "the scan does not show the head; it is the model's".into())
    }

    /// Takes limbs out of the fit.
    pub(super) fn leave_out(&mut self, unseen: &[JointId]) {
        let skeleton = &self.model.skeleton;
        for &joint in unseen {
            for (held, j) in self.held.iter_mut().zip(skeleton.ids()) {
                *held |= skeleton.is_below(j, joint);
            }
            if let Some(part) = self.parts.iter().find(|p| p.joint == joint) {
                for (out, belongs) in self.left_out.0.iter_mut().zip(part.vertices.iter()) {
                    *out |= belongs;
                }
            }
        }
    }

    /// The fit again, with some limbs left out of it.
    fn without(
        &mut self,
        unseen: &[JointId],
        found: Found,
        log: &mut Vec<String>,
        on_step: &mut dyn FnMut(&Step),
    ) -> Found {
        let skeleton = &self.model.skeleton;
        for &joint in unseen {
            log.push(format!(
                "the scan does not show the {}; it takes the pose of the other side",
                limbs::spoken(&skeleton.names[joint.index()])
            ));
        }
        self.leave_out(unseen);
        // The trunk gave way to the limb that was pulled into it: back to the expected pose, and on from there.
        let mut pose = with_trunk_straight(self, &found.pose);
        for &joint in unseen {
            limbs::pose_like_other_side(&mut pose, skeleton, joint, unseen);
        }
        let mut found = self.refine(pose, found.shape, on_step);
        for &joint in unseen {
            limbs::pose_like_other_side(&mut found.pose, skeleton, joint, unseen);
        }
        found
    }

    /// Runs a stage on what was found so far; `index` holds the model in some pose.
    fn run(&self, stage: &Stage, found: &mut Found, index: &mut SurfaceIndex, on_step: &mut dyn FnMut(&Step)) {
        let places = self.places(stage.samples);
        let (is_still, rounds) = if stage.reach > FINEST.reach { (NEARLY_STILL, 1) } else { (STILL, 2) };
        let mut still = 0;
        for _ in 0..stage.iterations {
            let posed = self.body.posed(&found.pose, &found.shape);
            index.follow(&self.mesh(&posed));
            let (mut equations, residual) = self.equations(stage, &places, &posed, &found.pose, index);
            equations.add_shape_prior(&found.shape, self.params.shape_prior);
            equations.freeze_all_but(&self.unknowns(stage.shape));
            let Some(delta) = equations.solve(1e-4) else { break };
            let (pose, shape) = self.body.stepped(&posed, &found.pose, &found.shape, &delta);
            let moved = self.moved(&posed, &pose, &shape);
            (found.pose, found.shape) = (pose, shape);
            found.iterations += 1;
            on_step(&Step { iteration: found.iterations, moved, residual, surface: index.mesh() });
            still = if moved < is_still { still + 1 } else { 0 };
            if still >= rounds {
                break;
            }
        }
        found.converged = still > 0;
    }

    pub(super) fn unknowns(&self, shape: bool) -> Unknowns {
        Unknowns { joints: self.held.iter().map(|held| !held).collect(), shape }
    }

    /// About `count` places on the model, as far as it takes part, and on the scan.
    pub(super) fn places(&self, count: usize) -> Places {
        let mut areas = self.model.template.vertex_areas();
        for (area, out) in areas.0.iter_mut().zip(self.left_out.iter()) {
            *area = if *out { 0.0 } else { *area };
        }
        let (model, scan) = (spread(&areas, count), self.surface.trusted_samples(count));
        let (near_model, near_scan) = (LastFaces::none(model.len()), LastFaces::none(scan.len()));
        Places { model, scan, near_model, near_scan }
    }

    /// What a step solves but for the shape prior, with the mean distance of what is drawn together. `index` holds `posed`.
    pub(super) fn equations(
        &self,
        stage: &Stage,
        places: &Places,
        posed: &Posed,
        pose: &Pose,
        index: &SurfaceIndex,
    ) -> (NormalEquations, f64) {
        let normals = index.mesh().vertex_normals_by_area();
        let mut residuals = self.model_to_scan(posed, &normals, stage, places);
        let takes = |corners: &[VertexId; 3]| corners.iter().all(|&v| !self.left_out[v]);
        let (reach, least_cosine) = (stage.reach, stage.least_cosine);
        let of_scan = (places.scan.as_slice(), &places.near_scan);
        residuals.extend(scan_to_mesh_from(self.surface, index, &normals, of_scan, reach, least_cosine, takes));
        let mut equations = self.body.normal_equations(posed, &residuals, &self.unknowns(stage.shape));
        let stiffness = pose_stiffness(&self.body.skeleton, self.params.pose_prior);
        let prior =
            PosePrior { center: &self.center, stiffness: &stiffness, limits: &self.model.limits, limit_stiffness: 2e4 };
        equations.add_pose_prior(posed, pose, &prior);
        (equations, mean_gap(&residuals))
    }

    pub(super) fn moved(&self, posed: &Posed, pose: &Pose, shape: &Shape) -> f64 {
        let after = self.model.skeleton_of(shape).joints_in_world(pose);
        posed.joints_in_world.iter().zip(&after).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    }

    fn model_to_scan(&self, posed: &Posed, normals: &PerVertex<Vec3>, stage: &Stage, places: &Places) -> Vec<Residual> {
        places
            .model
            .par_iter()
            .enumerate()
            .filter_map(|(k, &(v, area))| {
                let p = posed.points[v];
                let hit = self.surface.nearest_from(&p, stage.reach, &places.near_model, k)?;
                if hit.at_rim || hit.normal.dot(&normals[v]) < stage.least_cosine {
                    return None;
                }
                let gap = hit.normal.dot(&(hit.point - p));
                let weight = hit.trust * robust(area, hit.distance, stage.reach);
                Some(Residual::on_vertex(v, hit.normal, gap, weight))
            })
            .collect()
    }

    /// Mean truncated distance both ways: comparable between starts whatever they have matched.
    pub(super) fn score(&self, pose: &Pose, shape: &Shape) -> f64 {
        /// Truncation: an arm that points elsewhere counts as this far. Metres.
        const TRUNCATE: f64 = 0.15;
        let mesh = self.mesh(&self.body.posed(pose, shape));
        let there = || mean_truncated(&self.surface.index, &mesh, &mesh.vertex_areas(), TRUNCATE);
        let back = || {
            let mut index = self.index.clone();
            index.follow(&mesh);
            mean_truncated(&index, self.surface.mesh(), &self.surface.areas, TRUNCATE)
        };
        let (there, back) = rayon::join(there, back);
        0.5 * (there + back)
    }

    /// Mean distance of the scan from the model.
    pub(super) fn residual_of(&self, pose: &Pose, shape: &Shape) -> f64 {
        trust::agreement(&self.index_at(pose, shape), self.surface).residual.0
    }
}
