//! `overcoat log`: lists the changes of a session, done and undone, on each branch.

use super::console::{Context, Done};
use crate::session::Branch;
use serde_json::{Value, json};

#[derive(clap::Args)]
pub(super) struct LogArgs {
    /// List every branch, not only the current one
    #[arg(long)]
    all: bool,
}

pub(super) fn run(args: LogArgs, context: &Context) -> anyhow::Result<Done> {
    let session = context.reader()?;
    let history = session.history();
    let current = history.current();
    let shown: Vec<&Branch> = match args.all {
        true => history.branches().iter().collect(),
        false => vec![current],
    };
    let json = json!({
        "session": context.session.display().to_string(),
        "branch": current.name,
        "branches": shown.iter().map(|branch| as_json(branch)).collect::<Vec<_>>(),
        "edited_by_hand": session.is_edited_by_hand(),
    });
    let mut done = Done::new("log", json);
    if session.is_edited_by_hand() {
        done = done.line("      recipe.toml by hand (the next change or `build` records it)");
    }
    for branch in shown {
        done = done.lines(lines_of(branch, branch.name == current.name));
    }
    Ok(done.next(context.overcoat("undo")).next(context.overcoat("status")))
}

/// Newest first, the order in which changes are undone.
fn lines_of(branch: &Branch, is_current: bool) -> Vec<String> {
    let mark = if is_current { "" } else { " (not current)" };
    let undone = branch.undone.iter().map(|e| format!("  ~ {:>4}  {}  (undone)", e.number, e.change));
    let done = branch.done.iter().enumerate().rev().map(|(i, e)| {
        let here = if i + 1 == branch.done.len() { '*' } else { ' ' };
        format!("  {here} {:>4}  {}", e.number, e.change)
    });
    std::iter::once(format!("branch {}{mark}", branch.name)).chain(undone).chain(done).collect()
}

fn as_json(branch: &Branch) -> Value {
    json!({ "name": branch.name, "done": branch.done, "undone": branch.undone })
}
