//! The measures: one definition each, and the targets beside them.
//!
//! # How the data flows in
//! The caller opens files and poses figures; [`measure`] only compares meshes. **All meshes and joints of one step are
//! in one common frame, metres**: either all in the frame of the scan's file, or all in ours (the truth files are in
//! the frame of the scan's file, so map them by the scan's `world_from_file`).
//!
//! ```text
//! truth folder  --TruthNaming::{joints, step_body, step_layer, bind_body, bind_layer} say which files-->
//!    TruthJoints::from_json(&text)       names and joints of all steps, MakeHuman's bone names or ours
//!    TruthStep { body, layers, joints }  step k has k layers, innermost first: joints = truth_joints.at(k)
//! session       --for step k: Figure::posed(&pose of step k), with the step's offsets-->
//!    ResultStep { body, garments, joints, scan, .. }   step k has k garments, in the order in which they came
//!    ResultBind { layers: [("body", mesh), ("tshirt", mesh), ..] }           innermost first
//! measure(&result_steps, &bind, &truth_steps, truth_bind, kind) -> Measures  (serde: the JSON of `measure --json`)
//! ```
//! The garment that step k brought is `garments[k - 1]`, and is judged against `layers[k - 1]`, whatever it is called.

mod crossings;
mod garment;
mod hidden;
mod laid;
mod sample;
mod surface;
mod targets;
#[cfg(test)]
mod tests;
mod truth;

pub use garment::{LayerPair, garment_iou, hem_loops, hem_roughness, inside_percent, layer_pairs};
pub use hidden::{HiddenBody, hidden_body};
pub use laid::scan_from_truth;
pub use surface::{SurfaceDistance, joint_mean_mm, outside_scan, surface_distance};
pub use targets::{SubjectKind, Verdict};
pub use truth::{JointPositions, STRICT_JOINTS, TruthBind, TruthJoints, TruthNaming, TruthStep};

use crate::geometry::{PerVertex, TriMesh};
use serde::{Deserialize, Serialize};

/// What a session made of one step.
#[derive(Clone, Debug)]
pub struct ResultStep {
    /// `body`, or the name of the garment that this step brought.
    pub name: String,
    /// The body, posed, with the step's offsets.
    pub body: TriMesh,
    /// For the naked step: the model's surface of β and θ alone, posed, before registration.
    pub fitted: Option<TriMesh>,
    /// The garments so far, posed, in the order in which they came.
    pub garments: Vec<(String, TriMesh)>,
    /// Joint centres, posed.
    pub joints: JointPositions,
    /// The cleaned scan.
    pub scan: TriMesh,
    /// The new garment's label of each vertex of `scan`; `None` for the naked step.
    pub labels: Option<PerVertex<bool>>,
    /// Which vertices of `body` the new garment's template covers; `None` for the naked step.
    pub covered: Option<PerVertex<bool>>,
    /// How far skin may lie outside the noisy scan and still count as inside: metres, as the fit states it.
    pub margin: f64,
    /// How many hems the template expects.
    pub hem_loops_expected: Option<usize>,
}

/// What a session made, in the bind pose.
#[derive(Clone, Debug)]
pub struct ResultBind {
    /// Name and surface, innermost first; the body is the first.
    pub layers: Vec<(String, TriMesh)>,
}

/// All measures of a session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// One a step.
    pub steps: Vec<StepMeasures>,
    /// All pairs of layers in the bind pose.
    pub pairs: Vec<LayerPair>,
    /// The targets, T2–T10, as far as this session can be judged by them.
    pub targets: Vec<Verdict>,
}

/// The measures of one step. What does not apply is absent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepMeasures {
    /// 0 is the naked body.
    pub step: usize,
    /// `body`, or the garment.
    pub name: String,
    /// The naked body as registered.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceDistance>,
    /// The naked body by model alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model_only: Option<SurfaceDistance>,
    /// Mean over the strict joints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint_mean_mm: Option<f64>,
    /// Area share (0–1) of well seen covered skin outside the scan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outside_scan: Option<f64>,
    /// The body under cloth.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub hidden: Option<HiddenBody>,
    /// The new garment.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub garment: Option<GarmentMeasures>,
}

/// The garment that a step brought.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GarmentMeasures {
    /// Area-weighted, against truth labels.
    pub garment_iou: f64,
    /// Against the true garment, at this step: both directions, the larger.
    pub garment_surface_mean_mm: f64,
    /// The same in the bind pose, where the truth's bind pose is the result's own (subjects of our own model).
    pub garment_surface_bind_mean_mm: Option<f64>,
    /// Boundary loops found.
    pub hem_loops: usize,
    /// Boundary loops that the template expects.
    pub hem_loops_expected: Option<usize>,
    /// Degrees of turning per centimetre of hem.
    pub hem_roughness: f64,
}

/// What keeps a session from being measured.
#[derive(Debug, thiserror::Error)]
pub enum MetricsError {
    /// More steps than truth.
    #[error("the session has {steps} steps, but the truth only {truth_steps}")]
    MoreStepsThanTruth {
        /// The session's.
        steps: usize,
        /// The truth's.
        truth_steps: usize,
    },
    /// Truth lacks the layer that a step brought.
    #[error("step {step} ('{name}') brought garment {garment}, but its truth has {layers} layers")]
    LayerMissing {
        /// The step.
        step: usize,
        /// Its name.
        name: String,
        /// Which garment, from 1.
        garment: usize,
        /// How many the truth has.
        layers: usize,
    },
    /// An attribute of another mesh.
    #[error("step {step} ('{name}') has {found} values of '{what}' for {expected} vertices")]
    CountMismatch {
        /// The step.
        step: usize,
        /// Its name.
        name: String,
        /// `labels` or `covered`.
        what: &'static str,
        /// Values.
        found: usize,
        /// Vertices.
        expected: usize,
    },
    /// `joints.json` cannot be read.
    #[error("the truth's joints.json cannot be read: {reason}")]
    BadJoints {
        /// Line, column and cause.
        reason: String,
    },
}

impl MetricsError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::MoreStepsThanTruth { .. } | Self::LayerMissing { .. } => {
                "the truth folder must be that of this very session: K_body.ply and K_layer1.ply … K_layerK.ply for each step K".into()
            }
            Self::CountMismatch { .. } => "this is a fault of the program, not of your data; please report it".into(),
            Self::BadJoints { .. } => {
                r#"expected {"names": […], "steps": [{"joints": {"hips": [x, y, z], …}}, …]}, metres"#.into()
            }
        })
    }
}

/// Measures a session against its truth; see the head of this file for what goes in.
///
/// `truth_bind` is compared only for subjects of our own model: another rig's bind pose is another pose.
///
/// **Errors** when session and truth do not belong together.
pub fn measure(
    results: &[ResultStep],
    bind: &ResultBind,
    truths: &[TruthStep],
    truth_bind: Option<&TruthBind>,
    kind: SubjectKind,
) -> Result<Measures, MetricsError> {
    if results.len() > truths.len() {
        return Err(MetricsError::MoreStepsThanTruth { steps: results.len(), truth_steps: truths.len() });
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
    let targets = targets::judge(&steps, &pairs, kind);
    Ok(Measures { steps, pairs, targets })
}

fn measure_step(
    step: usize,
    result: &ResultStep,
    truth: &TruthStep,
    bind: &ResultBind,
    truth_bind: Option<&TruthBind>,
) -> Result<StepMeasures, MetricsError> {
    check_counts(step, result)?;
    let naked = result.garments.is_empty();
    let outside_scan = match (&result.covered, naked) {
        (Some(covered), false) => Some(outside_scan(&result.body, covered, &result.scan, result.margin)),
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
        hidden: (!naked).then(|| hidden_body(&result.body, &truth.body, &truth.layers)),
        garment,
    })
}

fn measure_garment(
    step: usize,
    (name, mesh): &(String, TriMesh),
    result: &ResultStep,
    truth: &TruthStep,
    bind: &ResultBind,
    truth_bind: Option<&TruthBind>,
) -> Result<GarmentMeasures, MetricsError> {
    let garment = result.garments.len() - 1;
    let Some(true_garment) = truth.layers.get(garment) else {
        let layers = truth.layers.len();
        return Err(MetricsError::LayerMissing { step, name: result.name.clone(), garment: garment + 1, layers });
    };
    let unlabelled = PerVertex::filled(false, result.scan.vertex_count());
    let labels = result.labels.as_ref().unwrap_or(&unlabelled);
    let in_bind = bind.layers.iter().find(|(n, _)| n == name).map(|(_, m)| m);
    let true_in_bind = truth_bind.and_then(|b| b.layers.get(garment));
    Ok(GarmentMeasures {
        garment_iou: garment_iou(&result.scan, labels, &truth.body, &truth.layers, garment),
        garment_surface_mean_mm: surface_distance(mesh, true_garment).surface_mean_mm,
        garment_surface_bind_mean_mm: in_bind.zip(true_in_bind).map(|(m, t)| surface_distance(m, t).surface_mean_mm),
        hem_loops: hem_loops(mesh),
        hem_loops_expected: result.hem_loops_expected,
        hem_roughness: hem_roughness(mesh),
    })
}

fn check_counts(step: usize, result: &ResultStep) -> Result<(), MetricsError> {
    let sizes = [
        ("labels", result.labels.as_ref().map(PerVertex::len), result.scan.vertex_count()),
        ("covered", result.covered.as_ref().map(PerVertex::len), result.body.vertex_count()),
    ];
    for (what, found, expected) in sizes {
        if let Some(found) = found.filter(|&n| n != expected) {
            return Err(MetricsError::CountMismatch { step, name: result.name.clone(), what, found, expected });
        }
    }
    Ok(())
}
