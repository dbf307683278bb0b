//! `overcoat mask`: correct a garment's labels.

use super::Context;
use super::console::{Done, secs};
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct MaskArgs {
    /// The garment
    layer: String,
    /// Brush strokes (.jsonl), or one label a vertex of its scan (.npy, .ply)
    file: PathBuf,
}

pub(super) fn run(args: MaskArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let file = context.input(args.file);
    let report = context.writer()?.add_mask(&args.layer, &file)?;
    let json = json!({
        "session": context.session.display().to_string(),
        "layer": args.layer,
        "file": file.display().to_string(),
        "added_vertices": report.added,
        "erased_vertices": report.erased,
        "secs": began.elapsed().as_secs_f64(),
    });
    Ok(Done::new("mask", json)
        .line(format!(
            "marked {} vertices of the scan as {}, {} as not, in {}",
            report.added,
            args.layer,
            report.erased,
            secs(began.elapsed())
        ))
        .next(context.overcoat("build")))
}
