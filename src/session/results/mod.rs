//! Queries of a built session: posed steps, exports, measures, pictures, recordings.

mod animation;
mod body_measures;
mod export;
mod export_character;
mod export_request;
mod export_smpl;
mod measure;
mod normal_maps;
mod outputs;
mod pictures;
mod posed_step;
mod protected;
mod recordings;
mod rest_pose;
mod shown;
mod status;
mod textures;
mod to_paint;
mod tried_pose;
mod tried_sizes;
mod trims;

pub use animation::{AnimationStatus, Film, SequenceKind, SequenceRequest};
pub use export_request::{ExportRequest, ExportStep, Exported, Faces, Textures};
pub use measure::{LabelMeasures, SubjectOrigin, TruthReport};
pub use outputs::{Content, NewFolder, Outputs, StreamedOutput};
pub use pictures::{ClipFrame, TriedSteps, girth_notes};
pub(in crate::session) use recordings::{AnimationRecording, FitRecording, ScanRecording};
pub use recordings::{DriveView, LiveView, ShowIn};
pub use shown::{Shown, ShownStep};
pub use status::StepStatus;
pub(in crate::session) use status::not_built_is_fine;
pub use textures::TextureSize;
pub use to_paint::ToPaint;
pub use tried_pose::TriedPose;
pub use tried_sizes::{SizedFile, TriedSizes};
