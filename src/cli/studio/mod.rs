//! `overcoat studio make`: generates a synthetic subject and its scans, with ground truth.

mod error;
mod make;

use super::console::{Context, Done, Verbosity, print_aside, secs};
use crate::studio::{GarmentKind, SubjectParams};
pub use error::MakeError;
use make::{MakeRequest, make_subject};
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct StudioArgs {
    #[command(subcommand)]
    action: StudioAction,
}

#[derive(clap::Subcommand)]
enum StudioAction {
    /// Generate a whole session: recordings, fused scans, and the ground truth
    Make(MakeArgs),
    /// List the garments that can be generated
    Garments,
}

#[derive(clap::Args)]
struct MakeArgs {
    /// Seed of the subject, the poses, the cloth and the noise: equal seeds give equal bytes.
    /// docs/evaluation.md lists the spent seeds
    #[arg(long, value_name = "N")]
    seed: u64,
    /// The garments, from the inside out: `tshirt,jeans,coat`
    #[arg(long, value_name = "A,B,…")]
    garments: String,
    /// Scan the person bare and then once in all garments, for `overcoat scan outfit`
    #[arg(long)]
    one_scan: bool,
    /// Folder to write: a new one, or an empty one
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Frames per step
    #[arg(long, value_name = "N")]
    views: Option<usize>,
    /// Turns of the turntable per step
    #[arg(long, value_name = "N")]
    turns: Option<f64>,
    /// Pixels of a frame; the field of view stays the same
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[usize; 2]>,
    /// Sway of the head within a turn, in millimetres
    #[arg(long, value_name = "MM")]
    sway: Option<f64>,
    /// Triangles of a fused scan
    #[arg(long, value_name = "N")]
    faces: Option<usize>,
    /// Simulate a camera without noise
    #[arg(long)]
    no_noise: bool,
    /// Write the fused scans and the ground truth, but no frames
    #[arg(long)]
    no_frames: bool,
}

pub(super) fn run(args: StudioArgs, context: &Context) -> anyhow::Result<Done> {
    match args.action {
        StudioAction::Make(args) => make(args, context),
        StudioAction::Garments => Ok(garments()),
    }
}

fn make(args: MakeArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let request = MakeRequest {
        subject: SubjectParams {
            seed: args.seed,
            garments: args.garments.clone(),
            one_scan: args.one_scan,
            views: args.views,
            turns: args.turns,
            size: args.size,
            sway_mm: args.sway,
            faces: args.faces,
            noise: !args.no_noise,
        },
        frames: !args.no_frames,
    };
    let made = make_subject(&args.out, &request, &mut |step| {
        if context.console.verbosity > Verbosity::Quiet {
            let at = secs(began.elapsed());
            print_aside(&format!("{:<12} {} triangles scanned, after {at}", step.name, step.faces));
        }
    })?;
    let json = json!({
        "out": args.out.display().to_string(),
        "seed": args.seed,
        "steps": made,
        "secs": began.elapsed().as_secs_f64(),
    });
    let truth = args.out.join("truth");
    let count = GarmentKind::list(&args.garments).map_or(0, |kinds| kinds.len());
    Ok(Done::new("studio make", json)
        .line(format!(
            "generated a person and {} garments in {}, in {}",
            count,
            args.out.display(),
            secs(began.elapsed())
        ))
        .next(format!("overcoat new DIR, then scan each of {}", args.out.join("*.ply").display()))
        .next(format!("overcoat -C DIR measure --truth {} --invented", truth.display())))
}

fn garments() -> Done {
    let known = GarmentKind::ALL;
    let json = json!({ "garments": known.iter().map(|g| json!({ "name": g.name(), "template": g.template(), "about": g.about() })).collect::<Vec<_>>() });
    Done::new("studio garments", json).lines(known.iter().map(|g| format!("{:<12} {}", g.name(), g.about())))
}

fn size(text: &str) -> Result<[usize; 2], String> {
    let numbers = text.split_once('x').and_then(|(w, h)| Some([w.trim().parse().ok()?, h.trim().parse().ok()?]));
    numbers.ok_or_else(|| "expected width and height in pixels, such as 424x512".into())
}
