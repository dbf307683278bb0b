//! `overcoat undo`: undo the last changes.

use super::console::{Context, Done, secs};
use crate::session::{Entry, Writer};
use serde_json::json;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct UndoArgs {
    /// Number of changes
    #[arg(default_value_t = 1, value_name = "N", value_parser = at_least_one)]
    count: u32,
}

pub(super) fn run(args: UndoArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let mut writer = context.writer()?;
    let undone = writer.undo(args.count as usize)?;
    let json = moved(context, &writer, "undone", &undone, began);
    Ok(Done::new("undo", json)
        .lines(undone.iter().map(|entry| format!("undid {}: {}", entry.number, entry.change)))
        .line(now_after(&writer, began))
        .next(context.overcoat("redo"))
        .next(context.overcoat("status")))
}

/// The JSON output of `undo` and `redo`.
pub(super) fn moved(
    context: &Context,
    writer: &Writer,
    what: &str,
    entries: &[Entry],
    began: Instant,
) -> serde_json::Value {
    let branch = writer.session().history().current();
    json!({
        "session": context.session.display().to_string(),
        "branch": branch.name,
        what: entries,
        "last_change": branch.head(),
        "secs": began.elapsed().as_secs_f64(),
    })
}

/// The current state of the session, in one sentence.
pub(super) fn now_after(writer: &Writer, began: Instant) -> String {
    let branch = writer.session().history().current();
    let at = branch.head().map(|e| format!("{}: {}", e.number, e.change)).unwrap_or_default();
    format!("now after change {at} (branch {}), in {}", branch.name, secs(began.elapsed()))
}

/// A number of changes as text.
pub(super) fn at_least_one(text: &str) -> Result<u32, String> {
    text.parse().ok().filter(|&count| count > 0).ok_or_else(|| "give 1 or more".into())
}
