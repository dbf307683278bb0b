//! Synthetic subjects, garments and cameras with known ground truth.

mod camera;
mod collar;
mod dressing;
mod dummy;
mod error;
mod fabric;
mod fuse;
mod hem;
mod kind;
mod noise;
mod room;
mod scanner;
mod session;
mod sewing;
mod subject;
mod tailor;
mod tetrahedra;
mod turntable;
mod volume;

pub use camera::Lens;
pub use error::StudioError;
pub use kind::GarmentKind;
pub use noise::DepthNoise;
pub use scanner::{ScannerParams, simulate_scan};
pub use session::{InventedSession, InventedStep, JUDGING_SEEDS, StudioParams, invent, invent_each, invent_step};
pub use turntable::{RgbdFrame, RgbdRecording, TurntableParams, Worn, record_turn};
