//! The stages, one file each, and the walk that runs those that are out of date.

mod check;
mod cut;
mod event;
mod evidence;
mod figure;
mod fit;
mod later_scans;
pub(in crate::session) mod marks;
pub(in crate::session) mod pipeline;
mod pipeline_stage;
mod pose;
mod posed;
mod press;
mod reason;
mod register;
mod rig;
mod scan;
mod segment;
mod stack;
mod walk;

pub use event::{Event, Forced, StageReport};
pub(in crate::session) use fit::Fit;
pub(in crate::session) use pipeline::scan_of;
pub(in crate::session) use pipeline_stage::{StepPose, StepResults};
pub(in crate::session) use pose::margin;
pub(in crate::session) use posed::along_normals;
pub(in crate::session) use press::{PosedGarments, Press};
pub use reason::{Cause, Reason};
pub(in crate::session) use scan::{Scan, cleaned_scan};
pub(in crate::session) use segment::Segment;
pub(in crate::session) use walk::{Repaired, Walk};
