//! A session on disk: what the user requested, what is up to date, and the stages that make the rest. Prints nothing.
//!
//! ```text
//! recipe.toml  ->  walk through the stages  ->  artefacts/<hash>, session.json, timings.json
//! ```
//! Each folder imports only those before it:
//! ```text
//! store/     artefacts, durable writes, lock, journal, history
//! recipe/    steps, parameters, masks: what the user requested
//! open/      the folder of a session: opened, created, changed durably, undone; its painted kinds of garment
//! pipeline/  one file per stage, one function per kind of step, and the walk that runs what is out of date
//! results/   what a built session can be asked for: posed steps, exports, measures, pictures, recordings
//! change/    what changes a session: scans, masks, painted kinds, parameters, builds, replays, repairs
//! ``` A change is durable as soon as its line is in `journal.jsonl`. The recipe and the state that the line names are
//! artefacts too, so `undo`, `redo` and `branch` can restore every earlier state. They append lines too. `fsck`
//! rebuilds lost artefacts; `replay` builds everything in another session.

mod change;
mod error;
mod open;
mod output_error;
mod pipeline;
mod recipe;
mod results;
mod stage;
mod stage_error;
mod store;

pub use change::{
    Batch, Built, Damage, FsckReport, MaskInfo, MaskReport, NewAnimation, NewOutfit, NewScan, Painted, Recut, Repair,
    Replay, Replayed, StageRequest, StageRun, StepInfo, SubjectRun, TemplateReport, fsck, replay, replay_all,
    write_template_to_paint,
};
pub use error::SessionError;
pub use open::{
    BodyModelSource, Draft, NewSession, Session, Writer, create, read_body_model, read_input, read_mesh_file,
};
pub use output_error::OutputError;
pub use pipeline::{Cause, Event, Forced, MovedFrame, Reason, StageReport};
pub use pipeline::{read_clip, stages_of_animation};
pub use recipe::{
    AnimationRecipe, Assignment, BODY_STEP, BodySurface, KnownMeasures, PaintedKind, Parameter, Recipe, SourceFile,
    StepKind, StepPlace, StepRecipe, TryOnMethod, WEIGHT, check_mask_name, parameters_of,
};
pub use results::{
    AnimationStatus, ClipFrame, Content, ExportRequest, ExportStep, Exported, LabelMeasures, NewFolder, Outputs,
    ShowIn, Shown, ShownStep, SizedFile, StepStatus, SubjectOrigin, ToPaint, TriedPose, TriedSizes, TriedSteps,
    TruthReport, girth_notes,
};
pub use results::{DriveView, LiveView, StreamedOutput};
pub use results::{Faces, Film, SequenceKind, SequenceRequest, TextureSize, Textures};
pub use stage::Stage;
pub use stage_error::StageError;
pub use store::{
    Branch, Change, ContentHash, Entry, Failure, History, JournalLook, Kept, MAIN_BRANCH, Measures, Memory, Move,
    StageRecord, State, StepRecord, Store, Timings, Warning, name_and_unit,
};
