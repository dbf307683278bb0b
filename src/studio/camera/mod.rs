//! A depth camera that records someone on a turntable, and the software of a scanner that fuses its frames.
//!
//! Nothing here contains garment code: a scene is a set of coloured, labelled meshes.

mod backdrop;
mod fusion;
mod marching_tetrahedra;
mod noise;
mod pinhole;
mod render;
mod scanner;
mod turntable;

pub use noise::DepthNoise;
pub use pinhole::Lens;
pub use render::LabelledScene;
pub use scanner::{ScannerParams, scan_from_images, simulate_scan};
pub use turntable::{
    RgbdFrame, RgbdRecording, SceneSurface, TurntableParams, axis_of, merged, record, record_turn, recording,
};
