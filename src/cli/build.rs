//! `overcoat build`: runs every stage that is out of date.

use super::console::{Context, Done, Progress, secs, verdicts};
use crate::session::{Built, Forced, SessionError, Stage};
use serde_json::json;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct BuildArgs {
    /// Run stages again that are up to date: all, or those of the named steps, or the named stages
    #[arg(long, value_name = "STEP[/STAGE]", num_args = 0..)]
    force: Option<Vec<String>>,
    /// Exit with 1 unless every step is good
    #[arg(long)]
    strict: bool,
}

fn forced(typed: Option<Vec<String>>) -> Result<Forced, SessionError> {
    let Some(names) = typed else { return Ok(Forced::Nothing) };
    if names.is_empty() {
        return Ok(Forced::Everything);
    }
    let named = names.iter().map(|name| match name.split_once('/') {
        None => Ok((name.clone(), None)),
        Some((step, stage)) => match Stage::parse(stage) {
            Some(known) => Ok((step.to_string(), Some(known))),
            None => Err(SessionError::BadRequest {
                what: format!("there is no stage '{stage}'"),
                hint: verdicts::stages_hint(),
            }),
        },
    });
    Ok(Forced::Named(named.collect::<Result<_, _>>()?))
}

pub(super) fn run(args: BuildArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let forced = forced(args.force)?;
    let mut writer = context.writer()?;
    let mut progress = Progress::of_stages(&context.console, writer.session().stage_count());
    let Built { reports, verdicts } = writer.build(&forced, &mut |event| progress.show(event))?;
    progress.end();
    let ran = reports.iter().filter(|r| r.ran).count();
    let json = json!({
        "session": context.session.display().to_string(),
        "ran": ran,
        "steps": verdicts,
        "stages": reports,
        "peak_mib": peak_mib(),
        "secs": began.elapsed().as_secs_f64(),
    });
    let mut done = Done::new("build", json);
    done = match ran {
        0 => done.line(format!("everything was up to date ({} stages), in {}", reports.len(), secs(began.elapsed()))),
        _ => done.line(format!("built {ran} of {} stages in {}", reports.len(), secs(began.elapsed()))),
    };
    if ran == 0 {
        done = done.lines(verdicts.iter().map(verdicts::line));
    }
    done = match args.strict {
        true => verdicts::required_good(done, &verdicts, context),
        false => verdicts::required_unfailed(done, &verdicts, context),
    };
    Ok(done
        .next(context.overcoat("export character.glb"))
        .next(context.overcoat("view --sheet sheet.png"))
        .next(context.overcoat("status")))
}

/// The peak memory of this process, if the system reports it.
fn peak_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    line.trim().trim_end_matches("kB").trim().parse::<f64>().ok().map(|kib| kib / 1024.0)
}
