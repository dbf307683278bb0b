//! Fuses RGB-D frames of a person on a turntable into one surface.

mod align;
mod axis;
mod camera;
mod denoise;
mod error;
mod frame;
mod fuse;
mod integrate;
mod loop_closure;
mod marching_cubes;
mod mend;
mod open;
mod params;
mod person;
mod photograph;
mod pieces;
mod planes;
mod raycast;
mod report;
mod settle;
mod survey;
mod track;
mod view;
mod volume;

pub use camera::RgbdCamera;
pub use error::FusionError;
pub use fuse::fuse;
pub use params::FusionParams;
pub use photograph::{Photograph, photographs};
pub use report::{FramePose, Fusion, FusionReport, FusionStep, SurfaceSoFar};
