//! What changes a session: scans, masks, parameters, builds, replays, repairs.

mod add_scan;
mod animate;
mod batch;
mod build;
mod edit_steps;
mod fsck;
mod masks;
mod paint;
mod recut;
mod replay;
mod single_stage;
mod templates;

pub use add_scan::{NewOutfit, NewScan};
pub use animate::NewAnimation;
pub use batch::{Batch, SubjectRun, replay_all};
pub use build::Built;
pub use edit_steps::StepInfo;
pub use fsck::{Damage, FsckReport, Repair, fsck};
pub use masks::{MaskInfo, MaskReport};
pub use paint::Painted;
pub use recut::Recut;
pub use replay::{Replay, Replayed, replay};
pub use single_stage::{StageRequest, StageRun};
pub use templates::{TemplateReport, write_template_to_paint};
