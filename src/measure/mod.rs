//! The metrics, with one definition each, and their targets.
//!
//! # Input
//! The caller opens files and poses figures; [`measure`] only compares meshes. **All meshes and joints of one step are
//! in one common frame, metres**: either all in the frame of the scan's file, or all in ours (the truth files are in
//! the frame of the scan's file, so map them by the scan's `world_from_file`).
//!
//! ```text
//! truth folder  --TruthNaming::{JOINTS, step_body, step_layer, bind_body, bind_layer} name the files-->
//!    TruthJoints::from_json(&text)       names and joints of all steps, MakeHuman's bone names or ours
//!    TruthStep { body, layers, joints }  step k has k layers, innermost first: joints = truth_joints.at(k)
//! session       --for step k: Figure::posed(&pose of step k), with the step's offsets-->
//!    ResultStep { body, garments, joints, scan, .. }   step k has k garments, in the order in which they were put on
//!    ResultBind { layers: [("body", mesh), ("tshirt", mesh), ..] }           innermost first
//! measure(&result_steps, &bind, &truth_steps, truth_bind, kind) -> SessionMeasures  (serde: the JSON of `measure --json`)
//! ```
//! The garment that step k added is `garments[k - 1]`. It is compared with `layers[k - 1]`, whatever its name, unless
//! `ResultStep::true_layer` says otherwise: the steps of an outfit have one true step, whose layers have names.

mod alignment;
mod crossings;
mod error;
mod garment;
mod hems;
mod hidden;
mod report;
mod result;
mod sample;
mod session;
mod stretch;
mod surface;
mod targets;
#[cfg(test)]
mod tests;
mod through;
mod truth;

pub use alignment::scan_from_truth;
pub use error::MeasureError;
pub use garment::{LayerPair, garment_iou, inside_percent, layer_pairs};
pub use hems::{hem_loops, hem_roughness, hem_to_truth_mm};
pub use hidden::{HiddenBody, hidden_body};
pub use report::{GarmentMeasures, StepMeasures};
pub use result::{ResultBind, ResultStep};
pub use session::{SessionMeasures, measure};
pub use stretch::{PoseStretch, pose_stretch};
pub use surface::{SurfaceDistance, joint_mean_mm, outside_scan, surface_distance};
pub use targets::{SubjectKind, TargetCheck};
pub use truth::{JointPositions, STRICT_JOINTS, TruthBind, TruthJoints, TruthNaming, TruthStep, joints_by_name};
