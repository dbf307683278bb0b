//! Drives a figure from tracked landmarks in real time (Lifkooee 2019): streams, calibration, inverse kinematics, and the
//! paper's method with its pose recognition.

mod calibration;
mod error;
mod grounding;
mod ik;
mod landmark;
mod laplacian;
mod library_training;
mod player;
mod recognition;
mod stream;
#[cfg(test)]
mod tests;
mod transfer;
mod vmc_clip;

pub use calibration::{
    CALIBRATION_SECS, Calibration, StreamKind, calibrate, size_difference, still_window, why_not_still,
};
pub use error::DriveError;
pub use ik::{Driven, IkDriver};
pub use landmark::{DESCRIBED, LANDMARKS, Landmark, LandmarkFrame, Places};
pub use laplacian::{FrameUpdate, LaplacianBody, RightSide, Solved};
pub use library_training::{TrainingParams, TrainingReport, embedded_library, train_library};
pub use player::{KeyPoses, PlayedCounts, PlayedFrame, Player};
pub use recognition::{
    Angle, BodyRotations, Confusion, LibraryError, NEIGHBORS, PoseClasses, PoseLibrary, RecognitionError, Recognized,
    Recognizer, SalientAngle, body_rotations, complete_descriptor, descriptor, mirrored, pose_features, pose_of,
    principal_plane, random_poses, select_angles, thin,
};
pub use stream::{
    OneEuro, Smoothed, Smoothing, StreamError, StreamFormat, StreamOptions, StreamReader, VmcDecoder, VmcFrame,
};
pub use transfer::{Between, KeyPose, LaplacianDriver, TransferFrame, TransferParams, WornGarments};
pub use vmc_clip::VmcRig;
