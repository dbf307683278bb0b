//! Recordings for the Rerun viewer: scans, fits, animations, and a live view.

#[cfg(feature = "rerun")]
mod animation_recording;
#[cfg(feature = "rerun")]
mod drive_recording;
#[cfg(feature = "rerun")]
mod fit_recording;
#[cfg(feature = "rerun")]
mod live_view;
#[cfg(not(feature = "rerun"))]
mod no_recording;
#[cfg(not(feature = "rerun"))]
mod no_viewer;
#[cfg(feature = "rerun")]
mod recording;
#[cfg(feature = "rerun")]
mod scan_recording;
mod show_in;

#[cfg(feature = "rerun")]
pub(in crate::session) use animation_recording::AnimationRecording;
#[cfg(feature = "rerun")]
pub use drive_recording::DriveView;
#[cfg(feature = "rerun")]
pub(in crate::session) use fit_recording::FitRecording;
#[cfg(feature = "rerun")]
pub use live_view::LiveView;
#[cfg(not(feature = "rerun"))]
pub(in crate::session) use no_recording::{AnimationRecording, FitRecording, ScanRecording};
#[cfg(not(feature = "rerun"))]
pub use no_viewer::{DriveView, LiveView};
#[cfg(feature = "rerun")]
pub(in crate::session) use scan_recording::ScanRecording;
pub use show_in::ShowIn;
