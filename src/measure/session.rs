//! All metrics of a session.

use super::error::MeasureError;
use super::garment::{LayerPair, garment_iou, layer_pairs};
use super::hems::{boundary_loops, hem_roughness, hem_to_truth_mm};
use super::hidden::hidden_body;
use super::report::{GarmentMeasures, StepMeasures};
use super::result::{ResultBind, ResultStep};
use super::stretch::pose_stretch;
use super::surface::{joint_mean_mm, outside_scan, surface_distance};
use super::targets::{SubjectKind, TargetCheck, check_targets};
use super::through::pose_through;
use super::truth::{TruthBind, TruthStep};
use crate::geometry::{PerVertex, TriMesh};
use serde::{Deserialize, Serialize};

/// All metrics of a session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SessionMeasures {
    /// One entry per step.
    pub steps: Vec<StepMeasures>,
    /// One entry per pair of layers in the bind pose.
    pub pairs: Vec<LayerPair>,
    /// The targets T2–T10 that apply to this session.
    pub targets: Vec<TargetCheck>,
}

/// Compares a session with its truth; the documentation of [`measure`](crate::measure) says what goes in.
///
/// `truth_bind` is compared only for subjects of our own model: another rig's bind pose is another pose.
///
/// **Shapes** `results` and `truths`: one entry per step.
///
/// **Errors** when session and truth do not belong together.
pub fn measure(
    results: &[ResultStep],
    bind: &ResultBind,
    truths: &[TruthStep],
    truth_bind: Option<&TruthBind>,
    kind: SubjectKind,
) -> Result<SessionMeasures, MeasureError> {
    if results.len() > truths.len() {
        return Err(MeasureError::MoreStepsThanTruth { steps: results.len(), truth_steps: truths.len() });
    }
    let truth_bind = truth_bind.filter(|_| kind == SubjectKind::Invented);
    let steps = results
        .iter()
        .zip(truths)
        .enumerate()
        .map(|(step, (result, truth))| measure_step(step, result, truth, bind, truth_bind))
        .collect::<Result<Vec<_>, _>>()?;
    let layers: Vec<(&str, &TriMesh)> = bind.layers.iter().map(|(name, mesh)| (name.as_str(), mesh)).collect();
    let pairs = layer_pairs(&layers);
    let targets = check_targets(&steps, &pairs, kind);
    Ok(SessionMeasures { steps, pairs, targets })
}

fn measure_step(
    step: usize,
    result: &ResultStep,
    truth: &TruthStep,
    bind: &ResultBind,
    truth_bind: Option<&TruthBind>,
) -> Result<StepMeasures, MeasureError> {
    check_counts(step, result)?;
    let naked = result.garments.is_empty();
    let outside_scan = match (&result.covered, naked) {
        (Some(covered), false) => outside_scan(&result.body, covered, &result.scan, result.margin)?,
        _ => None,
    };
    let garment = match result.garments.last() {
        Some(newest) => Some(measure_garment(step, newest, result, truth, bind, truth_bind)?),
        None => None,
    };
    Ok(StepMeasures {
        step,
        name: result.name.clone(),
        surface: naked.then(|| surface_distance(&result.body, &truth.body)),
        model_only: result.fitted.as_ref().map(|fitted| surface_distance(fitted, &truth.body)),
        joint_mean_mm: joint_mean_mm(&result.joints, &truth.joints),
        outside_scan,
        hidden: (!naked).then(|| hidden_body(&result.body, &truth.body, &cloth_of(result, truth))),
        garment,
    })
}

/// The true layers without hair.
fn cloth_of(result: &ResultStep, truth: &TruthStep) -> Vec<TriMesh> {
    let layers = truth.layers.iter().enumerate().filter(|(k, _)| !result.true_hair.contains(k));
    layers.map(|(_, layer)| layer.clone()).collect()
}

fn measure_garment(
    step: usize,
    (name, mesh): &(String, TriMesh),
    result: &ResultStep,
    truth: &TruthStep,
    bind: &ResultBind,
    truth_bind: Option<&TruthBind>,
) -> Result<GarmentMeasures, MeasureError> {
    let garment = result.true_layer.unwrap_or(result.garments.len() - 1);
    let Some(true_garment) = truth.layers.get(garment) else {
        let layers = truth.layers.len();
        return Err(MeasureError::LayerMissing { step, name: result.name.clone(), garment: garment + 1, layers });
    };
    let Some(labels) = &result.labels else {
        return Err(MeasureError::LabelsMissing { step, name: result.name.clone() });
    };
    let layer = bind.layers.iter().position(|(n, _)| n == name);
    let in_bind = layer.map(|k| &bind.layers[k].1);
    let true_in_bind = truth_bind.and_then(|b| b.layers.get(garment));
    let loops = boundary_loops(mesh);
    let hems = result.hem_loops.as_ref().unwrap_or(&loops);
    Ok(GarmentMeasures {
        garment_iou: garment_iou(&result.scan, labels, &truth.body, &truth.layers, garment)?,
        garment_surface_mean_mm: surface_distance(mesh, true_garment).surface_mean_mm,
        garment_surface_bind_mean_mm: in_bind.zip(true_in_bind).map(|(m, t)| surface_distance(m, t).surface_mean_mm),
        hem_loops: hems.len(),
        holes: loops.len().saturating_sub(hems.len()),
        hem_loops_expected: result.hem_loops_expected,
        hem_roughness: hem_roughness(mesh),
        hem_to_truth_mm: hem_to_truth_mm(mesh, hems, true_garment),
        stretch: layer.and_then(|k| pose_stretch(&bind.layers[k].1, bind.in_poses.iter().map(|posed| &posed[k]))),
        pose_through_percent: layer.and_then(|k| pose_through(bind, k)),
    })
}

fn check_counts(step: usize, result: &ResultStep) -> Result<(), MeasureError> {
    let sizes = [
        ("labels", result.labels.as_ref().map(PerVertex::len), result.scan.vertex_count()),
        ("covered", result.covered.as_ref().map(PerVertex::len), result.body.vertex_count()),
    ];
    for (what, found, expected) in sizes {
        if let Some(found) = found.filter(|&n| n != expected) {
            return Err(MeasureError::CountMismatch { step, name: result.name.clone(), what, found, expected });
        }
    }
    Ok(())
}
