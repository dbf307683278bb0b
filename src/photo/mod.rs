//! A body from the keypoints of one photo (SMPLify, Bogo 2016).
//!
//! [`read_keypoints`] reads what trackers write, [`body_from_photo`] computes shape and pose of the body model, and
//! [`PhotoBody::measures`] says how certain stature and girths are. Only the model, the keypoints and the camera are used; no
//! pixel of the photo is.

mod anchor;
mod camera;
mod capsules;
mod descent;
mod energy;
mod error;
mod flips;
mod keypoints;
mod mark;
mod prior;
mod record;
mod size;
mod solve;
#[cfg(test)]
mod tests;

pub use camera::PhotoCamera;
pub use error::PhotoError;
pub use keypoints::{Keypoint, Keypoints, read_keypoints};
pub use mark::{Layout, Mark};
pub use record::{read_photo_record, write_photo_record};
pub use size::UncertainMeasure;
pub use solve::{PhotoBody, PhotoParams, Search, body_from_photo, exact_keypoints};
