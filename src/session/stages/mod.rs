//! The stages, one file each, and the walk that runs those that are out of date.

mod cut;
mod dressed;
mod evidence;
mod figure;
mod fit;
pub(in crate::session) mod flow;
pub(in crate::session) mod marks;
mod other_steps;
mod pose;
mod press;
mod reason;
mod register;
mod rig;
pub(in crate::session) mod scan;
mod segment;
mod stack;
mod walk;

pub(in crate::session) use dressed::{Dressed, StepPose, Worn, along_normals};
pub(in crate::session) use flow::steps;
pub(in crate::session) use pose::margin;
pub use reason::{Cause, Reason};
pub use walk::{Event, Forced, StageReport};
pub(in crate::session) use walk::{Mended, Walk};
