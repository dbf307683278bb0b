//! Recordings of a depth camera: frames with depth and colour, and the camera's properties.

mod camera_json;
mod frames;
mod names;

pub use camera_json::{CameraJson, Intrinsics, read_camera_json, read_photo_camera_json};
pub use frames::{EncodedRecording, RecordedFrame, is_zip, read_recording, recording_files, write_recording};
