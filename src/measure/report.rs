//! The metrics of one step.

use super::hidden::HiddenBody;
use super::stretch::PoseStretch;
use super::surface::SurfaceDistance;
use serde::{Deserialize, Serialize};

/// The metrics of one step. Those that do not apply are absent.
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

/// The garment that a step added.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GarmentMeasures {
    /// Area-weighted, against truth labels.
    pub garment_iou: f64,
    /// Against the true garment, at this step: both directions, the larger.
    pub garment_surface_mean_mm: f64,
    /// That distance in the bind pose; only for synthetic subjects, whose bind pose is that of the result.
    pub garment_surface_bind_mean_mm: Option<f64>,
    /// Boundary loops that are hems, as the cut tells them from holes.
    pub hem_loops: usize,
    /// The other boundary loops: holes that are left.
    pub holes: usize,
    /// Hems that the template expects.
    pub hem_loops_expected: Option<usize>,
    /// Degrees of turning per centimetre of hem.
    pub hem_roughness: f64,
    /// Mean distance of the hems found to the nearest true hem.
    pub hem_to_truth_mm: Option<f64>,
    /// How far skinning stretches it: arms overhead, a squat, a raised thigh, a long step.
    #[serde(flatten)]
    pub stretch: Option<PoseStretch>,
    /// Share of the vertices below it that come out through it, in the worst of those poses, percent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose_through_percent: Option<f64>,
}
