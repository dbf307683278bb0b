//! `overcoat export`: writes the figure or a step as files.

use super::console::{Context, Done, secs};
use crate::session::ExportRequest;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct ExportArgs {
    /// `NAME.glb`, or a folder for one .ply per layer
    target: PathBuf,
    /// Export the pose of this step's scan, in the frame and unit of its file
    #[arg(long, value_name = "STEP")]
    at: Option<String>,
    /// Export the cleaned scan of this step, in the frame and unit of its file
    #[arg(long, value_name = "STEP")]
    scan: Option<String>,
    /// Export the result of this stage: `fit`, the body before registration; `--at body` is optional
    #[arg(long, value_name = "STAGE", value_parser = ["fit"], conflicts_with = "scan")]
    stage: Option<String>,
    /// Replace files that Overcoat did not write, or that were changed since
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: ExportArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let request =
        ExportRequest { target: args.target, at: args.at, scan: args.scan, before_registration: args.stage.is_some() };
    let session = context.reader()?;
    let mut outputs = session.outputs(args.force);
    let files = session.export(&request, &mut outputs)?;
    context.console.notices(outputs.notices());
    let shown: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
    let json = json!({
        "session": context.session.display().to_string(),
        "target": request.target.display().to_string(),
        "files": shown,
        "secs": began.elapsed().as_secs_f64(),
    });
    let count = match shown.len() {
        1 => "1 file".to_string(),
        n => format!("{n} files"),
    };
    Ok(Done::new("export", json)
        .line(format!("wrote {count} in {}", secs(began.elapsed())))
        .lines(shown.iter().map(|f| format!("  {f}")))
        .next(context.overcoat("view --sheet sheet.png")))
}
