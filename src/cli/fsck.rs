//! `overcoat fsck`: finds damaged files and rebuilds them.

use super::console::{Done, secs};
use super::context::Context;
use super::progress::Progress;
use crate::session::{Damage, Repair, fsck};
use serde_json::json;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct FsckArgs {
    /// Check only; change nothing
    #[arg(long)]
    check: bool,
}

pub(super) fn run(args: FsckArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let mut progress = Progress::of_stages(&context.console, 1);
    let report = fsck(&context.session, !args.check, &mut |event| progress.show(event))?;
    progress.end();
    let json = json!({
        "session": context.session.display().to_string(),
        "checked": report.checked,
        "sound": report.is_sound(),
        "damages": report.damages,
        "secs": began.elapsed().as_secs_f64(),
    });
    let took = secs(began.elapsed());
    let left: Vec<&Damage> = report.damages.iter().filter(|d| d.repair != Repair::Repaired).collect();
    let said = match (report.damages.len(), left.len()) {
        (0, _) => format!("all {} artefacts are sound, in {took}", report.checked),
        (n, 0) => format!("repaired all {n} damaged files among {} artefacts, in {took}", report.checked),
        (n, left) => {
            format!("{left} of {n} damaged files among {} artefacts could not be repaired, in {took}", report.checked)
        }
    };
    let mut done = Done::new("fsck", json).lines(report.damages.iter().map(line_of)).line(said);
    if let Some(first) = left.first() {
        let what = format!("{} is damaged: {}: {}", first.file, first.what, first.problem);
        done = match args.check {
            true => done.failed(what, format!("`{}` rebuilds it", context.overcoat("fsck"))),
            false => done.failed(what, format!("`{}` rebuilds what the session needs now", context.overcoat("build"))),
        };
    }
    Ok(done.next(context.overcoat("status")))
}

fn line_of(damage: &Damage) -> String {
    let repair = match &damage.repair {
        Repair::NotTried => String::new(),
        Repair::Repaired => "; repaired".into(),
        Repair::Not(why) => format!("; not repaired: {why}"),
    };
    format!("{}: {}: {}{repair}", damage.file, damage.what, damage.problem)
}
