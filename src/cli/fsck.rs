//! `overcoat fsck`: finds damaged files and rebuilds them.

use super::console::{Context, Done, Progress, secs};
use crate::session::{Damage, FsckReport, Repair, fsck};
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
    let said = sentence(&report, left.len(), args.check);
    let mut done = Done::new("fsck", json).lines(report.damages.iter().map(line_of)).line(format!("{said}, in {took}"));
    if let Some(first) = left.first() {
        let what = format!("{} is damaged: {}: {}", first.file, first.what, first.problem);
        done = match args.check {
            true => done.failed(what, format!("`{}` rebuilds it", context.overcoat("fsck"))),
            false => done.failed(what, format!("`{}` rebuilds what the session needs now", context.overcoat("build"))),
        };
    }
    Ok(done.next(context.overcoat("status")))
}

/// The outcome; `left` files are still damaged. A check tries no repair.
fn sentence(report: &FsckReport, left: usize, check: bool) -> String {
    let (checked, files) = (report.checked, counted(report.damages.len()));
    match (report.damages.len(), left) {
        (0, _) => format!("all {checked} artefacts are sound"),
        _ if check => format!("found {files} among {checked} artefacts; nothing was changed"),
        (_, 0) => format!("repaired {files} among {checked} artefacts"),
        (n, left) => format!("{left} of {n} damaged files among {checked} artefacts could not be repaired"),
    }
}

fn counted(damaged: usize) -> String {
    if damaged == 1 { "1 damaged file".into() } else { format!("{damaged} damaged files") }
}

fn line_of(damage: &Damage) -> String {
    let repair = match &damage.repair {
        Repair::NotTried => String::new(),
        Repair::Repaired => "; repaired".into(),
        Repair::Not(why) => format!("; not repaired: {why}"),
    };
    format!("{}: {}: {}{repair}", damage.file, damage.what, damage.problem)
}
