//! `overcoat branch`: tries something else without losing the current state.

use super::console::{Context, Done, secs};
use serde_json::json;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct BranchArgs {
    /// Switch to this branch; a new one starts at the current state. Without a name: list all branches
    name: Option<String>,
}

pub(super) fn run(args: BranchArgs, context: &Context) -> anyhow::Result<Done> {
    match args.name {
        Some(name) => switch(&name, context),
        None => list(context),
    }
}

fn switch(name: &str, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let mut writer = context.writer()?;
    let was = writer.session().history().current().name.clone();
    let is_new = writer.branch(name)?;
    let last_change = writer.session().history().current().head().cloned();
    let at = last_change.as_ref().map(|e| format!("{}: {}", e.number, e.change)).unwrap_or_default();
    let json = json!({
        "session": context.session.display().to_string(),
        "branch": name,
        "was": was,
        "new": is_new,
        "last_change": last_change,
        "secs": began.elapsed().as_secs_f64(),
    });
    let took = secs(began.elapsed());
    let said = match (is_new, was == name) {
        (true, _) => format!("created the branch {name} after {at}, in {took}; {was} is unchanged"),
        (false, true) => format!("already on the branch {name}, after {at}"),
        (false, false) => format!("switched from {was} to the branch {name}, after {at}, in {took}"),
    };
    let mut done = Done::new("branch", json).line(said).next(context.overcoat("build"));
    if was != name {
        done = done.next(context.overcoat(&format!("branch {was}")));
    }
    Ok(done)
}

fn list(context: &Context) -> anyhow::Result<Done> {
    let session = context.reader()?;
    let history = session.history();
    let current = &history.current().name;
    let json = json!({
        "session": context.session.display().to_string(),
        "branch": current,
        "branches": history.branches().iter().map(|b| json!({
            "name": b.name, "changes": b.done.len(), "undone": b.undone.len(), "last_change": b.head(),
        })).collect::<Vec<_>>(),
    });
    let lines = history.branches().iter().map(|b| {
        let mark = if b.name == *current { '*' } else { ' ' };
        let head = b.head().map(|e| format!("{}: {}", e.number, e.change)).unwrap_or_default();
        format!("{mark} {:<16} {head}", b.name)
    });
    Ok(Done::new("branch", json).lines(lines).next(context.overcoat("branch NAME")).next(context.overcoat("log --all")))
}
