//! Training: many bodies -> a body model. Meshes of one topology are used directly; scans are first registered: the
//! template is moved onto each.
//!
//! **Source** Hu 2017, §5.1, Eqs. 1–2.

mod build;
mod components;
mod error;
mod inputs;
mod learn;
mod leave_out;
mod makehuman;
mod makehuman_files;
mod params;
mod progress;
mod rig;
mod scans;
mod subjects;
mod unpose;

pub use build::{BuildParams, build_model};
pub use error::TrainError;
pub use inputs::TrainInputs;
pub use learn::{Trained, train};
pub use leave_out::{HoldOutErrors, split};
pub use makehuman::{MakeHumanFiles, MakeHumanParams, import_makehuman};
pub use params::TrainParams;
pub use progress::TrainingProgress;
pub use rig::Rig;
pub use scans::{ScanToRegister, ScannedBody, registered_bodies};
pub use subjects::{GivenJoints, Subjects};
