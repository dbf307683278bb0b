//! Queries of a built session: posed steps, exports, measures, pictures, recordings.

#[cfg(feature = "rerun")]
mod animation_recording;
mod animations;
mod body_measures;
mod covered;
mod crossing_row;
mod draw_garment;
mod export;
mod film;
#[cfg(feature = "rerun")]
mod fit_recording;
#[cfg(feature = "rerun")]
mod live_view;
mod measure;
#[cfg(not(feature = "rerun"))]
mod no_recording;
#[cfg(not(feature = "rerun"))]
mod no_viewer;
mod outputs;
mod posed_step;
mod poster;
mod protected;
#[cfg(feature = "rerun")]
mod recording;
#[cfg(feature = "rerun")]
mod scan_recording;
mod sequence;
mod sheet;
mod show_in;
mod status;
mod weights_sheet;

#[cfg(feature = "rerun")]
pub(in crate::session) use animation_recording::AnimationRecording;
pub use animations::AnimationStatus;
pub use covered::RemovedPart;
pub use export::{ExportRequest, Exported};
pub use film::Film;
#[cfg(feature = "rerun")]
pub(in crate::session) use fit_recording::FitRecording;
#[cfg(feature = "rerun")]
pub use live_view::LiveView;
pub use measure::{SubjectOrigin, TruthReport};
#[cfg(not(feature = "rerun"))]
pub(in crate::session) use no_recording::{AnimationRecording, FitRecording, ScanRecording};
#[cfg(not(feature = "rerun"))]
pub use no_viewer::LiveView;
pub use outputs::{Content, NewFolder, Outputs};
#[cfg(feature = "rerun")]
pub(in crate::session) use scan_recording::ScanRecording;
pub use sequence::{SequenceKind, SequenceRequest};
pub use show_in::ShowIn;
pub use status::StepStatus;
pub(in crate::session) use status::not_built_is_fine;
