//! `overcoat redo`: redo what was undone.

use super::console::{Context, Done};
use super::undo::{at_least_one, moved, now_after};
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct RedoArgs {
    /// Number of changes
    #[arg(default_value_t = 1, value_name = "N", value_parser = at_least_one)]
    count: u32,
}

pub(super) fn run(args: RedoArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let mut writer = context.writer()?;
    let redone = writer.redo(args.count as usize)?;
    let json = moved(context, &writer, "redone", &redone, began);
    Ok(Done::new("redo", json)
        .lines(redone.iter().map(|entry| format!("redid {}: {}", entry.number, entry.change)))
        .line(now_after(&writer, began))
        .next(context.overcoat("build"))
        .next(context.overcoat("status")))
}
