//! A session on disk: what was asked for, what stands, and every stage run on what is stale. Prints nothing.
//!
//! ```text
//! recipe.toml  ->  walk through the stages  ->  artefacts/<hash>, session.json, timings.json
//! ```
//! One file a stage: load, call, save. A change is durable as soon as its line is in `journal.jsonl`; the recipe and
//! the state that it names are artefacts too, so that every earlier state can be had again: by `undo`, `redo` and
//! `branch`, which are lines like any other, and read in `history`. `fsck` makes again what was lost; `replay` makes all
//! of it elsewhere.

mod add_scan;
mod assignment;
mod batch;
mod body_build;
mod body_import;
mod body_measures;
mod body_model;
mod body_show;
mod build;
mod draft;
mod draw_garment;
mod durable;
mod error;
mod export;
#[cfg(feature = "rerun")]
mod fit_recording;
mod flow;
mod fsck;
mod garment_kind;
mod hash;
mod history;
mod invent;
mod journal;
#[cfg(feature = "rerun")]
mod live_view;
mod lock;
mod mask_file;
mod masks;
mod measure;
mod memory;
mod new;
#[cfg(not(feature = "rerun"))]
mod no_recording;
#[cfg(not(feature = "rerun"))]
mod no_viewer;
mod open;
mod other_steps;
mod parameter_table;
mod parameters;
mod poster;
mod reason;
mod recipe;
mod recut;
mod replay;
#[cfg(feature = "rerun")]
mod scan_recording;
mod sections;
mod show_in;
#[cfg(feature = "rerun")]
mod shown;
mod single_stage;
mod source;
mod stage_cut;
mod stage_error;
mod stage_evidence;
mod stage_figure;
mod stage_fit;
mod stage_pose;
mod stage_press;
mod stage_register;
mod stage_rig;
mod stage_scan;
mod stage_segment;
mod stage_stack;
mod state;
mod store;
mod target;
mod timings;
mod undo;
mod view;
mod walk;
mod worn;

pub use add_scan::NewScan;
pub use assignment::Assignment;
pub use batch::{Batch, SubjectRun, replay_all};
pub use body_build::{BuildBody, BuiltBody, build_body};
pub use body_import::{ImportedBody, import_body};
pub use body_measures::{mesh_measures, model_measures};
pub use body_model::BodyModelSource;
pub use body_show::{ShowBody, ShownBody, show_body};
pub use build::StepStatus;
pub use draft::Draft;
pub use error::SessionError;
pub use export::ExportRequest;
pub use fsck::{Damage, FsckReport, Repair, fsck};
pub use hash::ContentHash;
pub use history::{Branch, Entry, History, MAIN_BRANCH};
pub use invent::{InventedGarments, MadeStep, MakeRequest, SubjectParams, make_subject};
pub use journal::{Change, Move};
#[cfg(feature = "rerun")]
pub use live_view::LiveView;
pub use masks::{MaskInfo, MaskReport};
pub use measure::{Subject, TruthReport};
pub use memory::Memory;
pub use new::{NewSession, create};
#[cfg(not(feature = "rerun"))]
pub use no_viewer::LiveView;
pub use open::{Session, Writer};
pub use parameters::{Allowed, Parameter, Setting, Settings, parameters_of};
pub use reason::{Cause, Reason};
pub use recipe::{BODY_STEP, BodySurface, Recipe, SourceFile, StepRecipe};
pub use recut::Recut;
pub use replay::{Replay, Replayed, replay};
pub use show_in::ShowIn;
pub use single_stage::{StageRequest, StageRun};
pub use stage_error::StageError;
pub use state::{Measures, Stage, StageRecord, State, StepRecord};
pub use store::{Kept, Store};
pub use target::{Judged, Verdict};
pub use timings::Timings;
pub use walk::{Event, Forced, StageReport};
