//! Compares a session with ground truth.

use super::posed_step::PosedStep;
use crate::body::Stance;
use crate::formats::read_ply;
use crate::geometry::{Point, TriMesh};
use crate::measure::{
    JointPositions, ResultBind, ResultStep, SessionMeasures as TruthMeasures, SubjectKind, TruthBind, TruthJoints,
    TruthNaming, TruthStep, measure, scan_from_truth,
};
use crate::scan::FileFrame;
use crate::session::error::SessionError;
use crate::session::open::{Session, source};
use crate::session::recipe::{GarmentSpec, StepRecipe, garment_spec};
use crate::session::stage::Stage;
use serde::Serialize;
use std::path::Path;

/// Poses in which cloth must not tear.
const STRETCHING: [Stance; 4] = [Stance::ArmsUp, Stance::Squat, Stance::ThighRaised, Stance::Stride];

/// The name of a layer of the truth that is hair.
const HAIR: &str = "hair";

/// The differences between a session and its ground truth.
pub type TruthReport = TruthMeasures;

/// Origin of the scanned body: a model fits bodies of its own family better than others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SubjectOrigin {
    /// Generated from our own body model.
    Invented,
    /// Any other body.
    Foreign,
}

/// A garment's labels beside true ones, on the vertices of its scan that have a true one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LabelMeasures {
    /// Vertices with a true label.
    pub vertices: usize,
    /// Vertices that are the garment by both, over those that are by either.
    pub iou: f64,
    /// Share of the garment's vertices that truly are.
    pub precision: f64,
    /// Share of the true garment's vertices that were found.
    pub recall: f64,
}

impl Session {
    /// Compares a garment's labels, as they are built, with true ones: a file as a mask may be. Of labels of several classes,
    /// `classes` are the garment's.
    ///
    /// **Errors** if the garment is not built, or if the file labels no vertex of its scan as the garment.
    pub fn measure_labels(&self, layer: &str, file: &Path, classes: &[i64]) -> Result<LabelMeasures, SessionError> {
        let truth = self.labels_in(layer, file, classes)?;
        let steps = self.posed_steps(Some(layer))?;
        let Some(labels) = steps.last().and_then(|posed| posed.labels.as_ref()) else {
            return Err(SessionError::MaskOnBody);
        };
        let mut counts = [[0_usize; 2]; 2];
        for (found, truth) in labels.0.iter().zip(truth.iter()) {
            if let Some(truth) = truth {
                counts[usize::from(*found)][usize::from(*truth)] += 1;
            }
        }
        let [[_, missed], [wrong, both]] = counts;
        if missed + both == 0 {
            return Err(SessionError::BadRequest {
                what: format!("'{}' labels no vertex of the scan as '{layer}'", file.display()),
                hint: "name the garment's class with --class".into(),
            });
        }
        let share = |of: usize| if of == 0 { 0.0 } else { both as f64 / of as f64 };
        let (iou, precision, recall) = (share(both + missed + wrong), share(both + wrong), share(both + missed));
        Ok(LabelMeasures { vertices: counts.iter().flatten().sum(), iou, precision, recall })
    }

    /// Measures all steps against the truth in `folder`: `K_body.ply`, `K_layerJ.ply`, `joints.json` and, if present,
    /// `bind_*.ply`, in the frame and unit of the scans' files. A scan fused from frames has a frame of its own: its
    /// truth, Y up and in metres, is first aligned with the scan.
    pub fn measure(&self, folder: &Path, subject: SubjectOrigin) -> Result<TruthReport, SessionError> {
        if !folder.is_dir() {
            return Err(SessionError::NoSuchFolder { path: folder.to_path_buf() });
        }
        let joints_path = folder.join(TruthNaming::JOINTS);
        let text = String::from_utf8(source::read(&joints_path)?).map_err(|e| {
            SessionError::reading(&joints_path, std::io::Error::new(std::io::ErrorKind::InvalidData, e))
        })?;
        let joints = TruthJoints::from_json(&text).map_err(|e| SessionError::bad_source(&joints_path, e))?;
        let knows_hair = joints.names.iter().any(|name| name == HAIR);
        let is_comparable = |posed: &PosedStep| posed.has_layer() && (knows_hair || !posed.step.is_hair());
        let steps: Vec<PosedStep> = self.posed_steps(None)?.into_iter().filter(is_comparable).collect();
        let of_truth = true_steps(&steps);
        let mut results = steps.iter().map(result_of).collect::<Result<Vec<_>, _>>()?;
        for (k, result) in
            results.iter_mut().enumerate().filter(|(k, _)| of_truth.last() != Some(&(steps.len() - 1)) && *k > 0)
        {
            result.true_layer = true_layer(&joints.names, &steps[k].step, k);
            result.true_hair = hair_among(&joints.names);
        }
        let truths = steps
            .iter()
            .zip(&of_truth)
            .map(|(posed, &k)| match self.is_recorded(posed) {
                true => Ok(aligned_with(&posed.scan.mesh, truth_of(folder, k, &joints, &FileFrame::identity())?)),
                false => truth_of(folder, k, &joints, &posed.scan.world_from_file),
            })
            .collect::<Result<Vec<_>, SessionError>>()?;
        let bind = bind_result(&steps);
        let truth_bind = bind_truth(folder)?;
        let kind = match subject {
            SubjectOrigin::Invented => SubjectKind::Invented,
            SubjectOrigin::Foreign => SubjectKind::Foreign,
        };
        measure(&results, &bind, &truths, truth_bind.as_ref(), kind).map_err(|e| SessionError::bad_source(folder, e))
    }

    /// Whether a step's scan was fused from RGB-D frames.
    fn is_recorded(&self, posed: &PosedStep) -> bool {
        self.state.record(&posed.step.name, Stage::Scan).is_some_and(|record| record.measures.contains_key("frames"))
    }
}

/// The step of the truth of each step. Steps with one scan, those of an outfit above all, have one; hair has the body's.
///
/// **Shapes** one entry per step.
fn true_steps(steps: &[PosedStep]) -> Vec<usize> {
    let (mut last, mut before) = (0, None);
    let mut of = |posed: &PosedStep| {
        if posed.step.is_body() || posed.step.is_hair() {
            return 0;
        }
        last += usize::from(before != Some(posed.step.hash));
        before = Some(posed.step.hash);
        last
    };
    steps.iter().map(&mut of).collect()
}

/// The layers of the truth that are hair, from their names.
fn hair_among(names: &[String]) -> Vec<usize> {
    names.iter().skip(1).enumerate().filter(|(_, name)| *name == HAIR).map(|(k, _)| k).collect()
}

/// The layer of the truth that is the garment of step `k`: that of its name or of its kind; otherwise that of its place, without
/// hair.
fn true_layer(names: &[String], step: &StepRecipe, k: usize) -> Option<usize> {
    let layers: Vec<&String> = names.iter().skip(1).collect();
    let named = |name: &str| layers.iter().position(|layer| *layer == name);
    let in_place = || (0..layers.len()).filter(|&j| layers[j] != HAIR).nth(k - 1);
    named(&step.name).or_else(|| named(step.template.as_deref()?)).or_else(in_place)
}

fn aligned_with(scan: &TriMesh, truth: TruthStep) -> TruthStep {
    let all: Vec<&TriMesh> = std::iter::once(&truth.body).chain(&truth.layers).collect();
    let motion = scan_from_truth(scan, &all);
    let moved = |mesh: &TriMesh| mesh.map_points(|p| motion * p);
    TruthStep {
        body: moved(&truth.body),
        layers: truth.layers.iter().map(moved).collect(),
        joints: truth.joints.into_iter().map(|(joint, p)| (joint, motion * p)).collect(),
    }
}

fn result_of(posed: &PosedStep) -> Result<ResultStep, SessionError> {
    let spec = posed.step.template.as_ref().map(|_| garment_spec::of_step(&posed.step)).transpose()?;
    let prior = |spec: &GarmentSpec| spec.template.prior(posed.figure.body(), &posed.figure.skeleton, &spec.extent);
    let covered = spec.as_ref().map(prior).transpose();
    let covered = covered.map_err(|e| SessionError::stage(&posed.step.name, Stage::Segment, e))?;
    let skeleton = &posed.figure.skeleton;
    let human = |(joint, p)| Some((skeleton.human_joint(joint)?, p));
    Ok(ResultStep {
        name: posed.step.name.clone(),
        body: posed.body(),
        fitted: posed.body_of_fit(),
        garments: posed.garments(),
        joints: skeleton.ids().zip(posed.joints()).filter_map(human).collect(),
        scan: posed.scan.mesh.clone(),
        labels: posed.labels.as_ref().map(|l| l.0.clone()),
        covered,
        true_layer: None,
        true_hair: Vec::new(),
        margin: crate::session::pipeline::margin(&posed.step)?,
        hem_loops: posed.hem_loops.clone(),
        hem_loops_expected: spec.map(|s| *s.template.expected_loops().end()),
    })
}

fn bind_result(steps: &[PosedStep]) -> ResultBind {
    let Some(figure) = steps.last().map(|posed| &posed.figure) else { return ResultBind::default() };
    let poses =
        STRETCHING.iter().flat_map(|stance| [stance.pose(&figure.skeleton), stance.mirrored_pose(&figure.skeleton)]);
    ResultBind {
        layers: figure.layers.iter().map(|layer| (layer.name.clone(), layer.mesh.clone())).collect(),
        in_poses: poses.map(|pose| figure.posed(&pose)).collect(),
    }
}

fn truth_of(folder: &Path, step: usize, joints: &TruthJoints, frame: &FileFrame) -> Result<TruthStep, SessionError> {
    let in_world = |mesh: TriMesh| mesh.map_points(|p| frame.world_from_file(p));
    let body = in_world(read_mesh(&folder.join(TruthNaming::step_body(step)))?);
    // Each step has a layer more than the one before, at least; the bare scan may show hair.
    let is_there = |layer: &usize| *layer <= step || folder.join(TruthNaming::step_layer(step, *layer)).is_file();
    let layers = (1..)
        .take_while(is_there)
        .map(|layer| read_mesh(&folder.join(TruthNaming::step_layer(step, layer))).map(in_world))
        .collect::<Result<Vec<_>, _>>()?;
    let of_step = joints.at(step).map_err(|e| SessionError::bad_source(&folder.join(TruthNaming::JOINTS), e))?;
    let joints: JointPositions = of_step.iter().map(|(joint, p)| (*joint, frame.world_from_file(p))).collect();
    Ok(TruthStep { body, layers, joints })
}

/// The truth in the bind pose, if present.
fn bind_truth(folder: &Path) -> Result<Option<TruthBind>, SessionError> {
    let body = folder.join(TruthNaming::bind_body());
    if !body.is_file() {
        return Ok(None);
    }
    let layers = (1..)
        .map(|layer| folder.join(TruthNaming::bind_layer(layer)))
        .take_while(|path| path.is_file())
        .map(|path| read_mesh(&path))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(Some(TruthBind { body: read_mesh(&body)?, layers }))
}

fn read_mesh(path: &Path) -> Result<TriMesh, SessionError> {
    let raw = read_ply(source::read(path)?.as_slice()).map_err(|e| SessionError::bad_source(path, e))?;
    let points = raw.points.into_iter().map(Point::from).collect();
    TriMesh::try_from_indices(points, &raw.faces).map_err(|e| SessionError::bad_source(path, e))
}
