//! Synthetic subjects, garments and cameras with known ground truth.

mod camera;
mod close_up;
mod error;
mod garments;
mod generate;
mod level_set;
mod params;
mod seeds;
mod subject;
mod subject_params;
mod textured;
mod turntable_subject;

pub use camera::{
    DepthNoise, Lens, RgbdFrame, RgbdRecording, ScannerParams, SceneSurface, TurntableParams, record_turn,
    simulate_scan,
};
pub use close_up::CloseUp;
pub use error::StudioError;
pub use garments::{GarmentFile, GarmentForm, GarmentKind, GarmentSize};
pub use generate::{
    SyntheticSession, SyntheticStep, generate_each_step, generate_garment, generate_session, generate_step,
};
pub use params::StudioParams;
pub use seeds::{FRESH_SEEDS_FROM, seeds_of};
pub use subject_params::SubjectParams;
pub use textured::{TriangleAtlas, with_picture};
