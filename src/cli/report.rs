//! `overcoat report`: one page about the session, to read and to send.

use super::console::{Context, Done, secs};
use crate::desk::report_page;
use crate::session::Content;
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct ReportArgs {
    /// The page [default: report.html in the session's folder]
    #[arg(value_name = "OUT.html")]
    out: Option<PathBuf>,
    /// Replace a file that Overcoat did not write, or that was changed since
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: ReportArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let session = context.reader()?;
    let path = args.out.unwrap_or_else(|| context.session.join("report.html"));
    let mut outputs = session.outputs(args.force);
    outputs.claim(&path, Content::Page)?;
    let page = report_page(&session)?;
    let bytes = page.len();
    outputs.write_bytes(&path, Content::Page, page.into_bytes())?;
    context.console.notices(outputs.notices());
    let json = json!({
        "session": context.session.display().to_string(),
        "report": path.display().to_string(),
        "bytes": bytes,
        "secs": began.elapsed().as_secs_f64(),
    });
    let size = bytes as f64 / 1e6;
    let line = format!("wrote {}, {size:.1} MB in one file, in {}", path.display(), secs(began.elapsed()));
    Ok(Done::new("report", json).line(line))
}
