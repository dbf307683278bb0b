//! `overcoat redo`: do again what was undone.

use super::console::Done;
use super::context::Context;
use super::undo::{moved, stands};
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct RedoArgs {
    /// How many changes
    #[arg(default_value_t = 1, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    count: u32,
}

pub(super) fn run(args: RedoArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let mut writer = context.writer()?;
    let redone = writer.redo(args.count as usize)?;
    let json = moved(context, &writer, "redone", &redone, began);
    Ok(Done::new("redo", json)
        .lines(redone.iter().map(|entry| format!("did again {}: {}", entry.number, entry.change)))
        .line(stands(&writer, began))
        .next(context.overcoat("build"))
        .next(context.overcoat("status")))
}
