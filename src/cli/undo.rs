//! `overcoat undo`: take the last changes back.

use super::console::{Done, secs};
use super::context::Context;
use crate::session::{Entry, Writer};
use serde_json::json;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct UndoArgs {
    /// How many changes
    #[arg(default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    count: u32,
}

pub(super) fn run(args: UndoArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let mut writer = context.writer()?;
    let undone = writer.undo(args.count as usize)?;
    let json = moved(context, &writer, "undone", &undone, began);
    Ok(Done::new("undo", json)
        .lines(undone.iter().map(|entry| format!("undid {}: {}", entry.number, entry.change)))
        .line(stands(&writer, began))
        .next(context.overcoat("redo"))
        .next(context.overcoat("status")))
}

/// What `undo` and `redo` tell programs.
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
        "stands_at": branch.head(),
        "secs": began.elapsed().as_secs_f64(),
    })
}

/// Where the session is now, in a sentence.
pub(super) fn stands(writer: &Writer, began: Instant) -> String {
    let branch = writer.session().history().current();
    let at = branch.head().map(|e| format!("{}: {}", e.number, e.change)).unwrap_or_default();
    format!("the session stands after {at} (branch {}), in {}", branch.name, secs(began.elapsed()))
}
