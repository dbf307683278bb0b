//! Training: many bodies -> a [`BodyModel`]. Meshes of one topology are learnt from as they are; scans are first
//! registered, each by the template moved onto it.
//!
//! **Source** Hu 2017, §5.1, Eqs. 1–2.

mod components;
mod error;
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

pub use error::TrainError;
pub use learn::{Trained, train};
pub use leave_out::{LeftOut, split};
pub use makehuman::{MakeHumanFiles, MakeHumanParams, import_makehuman};
pub use params::TrainParams;
pub use progress::TrainingProgress;
pub use rig::Rig;
pub use scans::{ScanToRegister, ScannedBody, registered_bodies};
pub use subjects::{GivenJoints, Subjects};
