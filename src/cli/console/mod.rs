//! What all commands share: their context, output, progress and verdicts, and the report of a bug.

mod context;
pub(super) mod fault;
mod output;
mod progress;
pub(super) mod verdicts;

pub(super) use context::{Commands, Context, quoted};
pub(super) use output::{Console, Done, Verbosity, print_aside, print_line, secs};
pub(super) use progress::{Progress, measures_text, why_text};
