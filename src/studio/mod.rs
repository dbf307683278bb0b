//! Invented subjects with known truth, and the measures by which every stage is judged.
//!
//! The measures know no stage: surfaces, joints and labels go in as plain meshes, see [`measure`].

mod camera;
mod collar;
mod drape;
mod dressing;
mod dummy;
mod error;
mod fabric;
mod fuse;
mod hem;
mod kind;
pub mod mannequin;
mod metrics;
mod noise;
mod rng;
mod room;
mod scanner;
mod session;
mod sewing;
mod solid;
mod subject;
mod tailor;
mod tetrahedra;
mod turntable;
mod volume;

pub use camera::Lens;
pub use error::StudioError;
pub use kind::GarmentKind;
pub use metrics::{
    GarmentMeasures, HiddenBody, JointPositions, LayerPair, Measures, MetricsError, ResultBind, ResultStep,
    STRICT_JOINTS, StepMeasures, SubjectKind, SurfaceDistance, TruthBind, TruthJoints, TruthNaming, TruthStep, Verdict,
    garment_iou, hem_loops, hem_roughness, hidden_body, inside_percent, joint_mean_mm, layer_pairs, measure,
    outside_scan, scan_from_truth, surface_distance,
};
pub use noise::DepthNoise;
pub use scanner::{ScannerParams, simulate_scan};
pub use session::{InventedSession, InventedStep, JUDGING_SEEDS, StudioParams, invent, invent_each, invent_step};
pub use turntable::{RgbdFrame, RgbdRecording, TurntableParams, Worn, record_turn};
