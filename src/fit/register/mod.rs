//! Non-rigid registration of the template to the naked scan.
//!
//! **Source** the surface of Hu 2017, §5.1 (Yamazaki 2013) in the manner of Amberg 2007: point-to-plane targets, a
//! membrane energy of the displacement with annealed stiffness, no targets at holes of the scan.

mod bind_pose;
mod colors;
mod displacement;
mod fill_in;
mod ground;
mod hair_above;
mod params;
mod registered_body;
mod registration;
mod report;
mod targets;
mod texture;
mod transfer;

pub use fill_in::FillInView;
pub use params::RegisterParams;
pub use registered_body::RegisteredBody;
pub use registration::{RegisterHints, register, register_with_hints};
pub use report::RegistrationReport;
pub use transfer::{closest_weights, scan_in_bind};
