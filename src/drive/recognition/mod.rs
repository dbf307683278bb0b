//! Pose recognition: a descriptor of angles, the class by a support vector machine, and the most similar poses of a library.
//!
//! **Source** Lifkooee 2019, §§3.2–3.3.

mod classes;
mod confusion;
mod descriptor;
mod error;
mod library;
mod recognizer;
mod sampling;
mod select;
#[cfg(test)]
mod synthetic;

pub use classes::{PoseClasses, pose_features};
pub use confusion::Confusion;
pub use descriptor::{Angle, complete_descriptor, descriptor, mirrored, principal_plane};
pub use error::RecognitionError;
pub use library::{BodyRotations, LibraryError, PoseLibrary, body_rotations, pose_of};
pub use recognizer::{NEIGHBORS, Recognized, Recognizer};
pub use sampling::{random_poses, thin};
pub use select::{SalientAngle, select_angles};
