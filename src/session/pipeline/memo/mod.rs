//! The one way to run a stage, and the walk that runs those that are out of date.

pub(in crate::session::pipeline) mod ahead;
pub(in crate::session::pipeline) mod at;
pub(in crate::session::pipeline) mod event;
pub(in crate::session::pipeline) mod input;
pub(in crate::session::pipeline) mod mention;
pub(in crate::session::pipeline) mod reason;
pub(in crate::session::pipeline) mod report;
pub(in crate::session::pipeline) mod run;
pub(in crate::session::pipeline) mod walk;
