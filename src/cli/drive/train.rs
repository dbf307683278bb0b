//! `overcoat drive train`: a pose library from clips.

use super::error::DriveFailure;
use crate::body::{Figure, embedded_model};
use crate::cli::console::{Context, Done, Progress, secs};
use crate::drive::{Angle, SalientAngle, TrainingParams, train_library};
use crate::motion::{MotionParams, built_in_clip, follow};
use crate::session::{Content, Outputs, SessionError, read_clip};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct TrainArgs {
    /// Clips: .bvh, .glb, .gltf, .jsonl, or walk, turn, squat, idle
    #[arg(required = true)]
    clips: Vec<String>,
    /// The library to write
    #[arg(short, long, value_name = "LIBRARY.poses")]
    out: PathBuf,
    /// Angles of the descriptor
    #[arg(long, default_value_t = 40, value_parser = clap::value_parser!(u16).range(4..=200))]
    angles: u16,
    /// Classes of poses
    #[arg(long, default_value_t = 24, value_parser = clap::value_parser!(u16).range(2..=200))]
    classes: u16,
    /// Poses mixed from the limbs of the clips, and as many drawn within the limits of the joints
    #[arg(long, default_value_t = 250, value_parser = clap::value_parser!(u16).range(0..=2000))]
    random: u16,
    /// Replace a file that Overcoat did not write
    #[arg(long)]
    force: bool,
}

/// Angles that are listed.
const LISTED: usize = 8;

pub(super) fn train(args: &TrainArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let mut outputs = Outputs::without_session(&context.session, args.force);
    outputs.claim(&args.out, Content::PoseLibrary)?;
    let model = embedded_model().map_err(DriveFailure::from)?;
    let figure = Figure::mean(&model);
    let mut progress = Progress::of_one_stage(&context.console);
    let mut clips = Vec::new();
    for name in &args.clips {
        progress.describe(name.clone());
        let clip = match built_in_clip(name) {
            Some(clip) => clip,
            None => {
                let path = Path::new(name);
                let bytes = std::fs::read(path).map_err(|e| SessionError::reading(path, e))?;
                read_clip(path, &bytes, None, Some(&figure.skeleton))?
            }
        };
        let params = MotionParams { ease_secs: 0.0, ..MotionParams::default() };
        let (track, _) = follow(&clip, &figure, None, None, &params).map_err(DriveFailure::from)?;
        clips.push((clip.name.clone(), track.poses));
    }
    progress.describe("choosing angles".into());
    let params = TrainingParams {
        angles: args.angles.into(),
        classes: args.classes.into(),
        random: args.random.into(),
        ..TrainingParams::default()
    };
    let (library, report) = train_library(&figure, &clips, &params).map_err(DriveFailure::from)?;
    progress.end();
    let bytes = library.write();
    let size = bytes.len();
    outputs.write_bytes(&args.out, Content::PoseLibrary, bytes)?;
    context.console.notices(outputs.notices());
    let named = |salient: &SalientAngle| {
        let Angle { marker, from, to } = salient.angle;
        format!("at {} between {} and {}", marker.name(), from.name(), to.name())
    };
    let angles: Vec<_> = report
        .angles
        .iter()
        .map(|a| json!({ "angle": named(a), "importance": a.importance, "variance": a.variance, "tree": a.tree }))
        .collect();
    let (poses, classes) = (library.poses().len(), report.sizes.len());
    let json = json!({
        "library": args.out.display().to_string(), "poses": poses, "classes": report.sizes, "angles": angles,
        "bytes": size, "secs": began.elapsed().as_secs_f64(),
    });
    let done = Done::new("drive train", json).line(format!(
        "built a library of {poses} poses in {classes} classes, described by {} angles, in {}: {} kB",
        report.angles.len(),
        secs(began.elapsed()),
        size.div_ceil(1000)
    ));
    let salient = report.angles.iter().take(LISTED);
    let lines = salient.map(|a| format!("  {}: variance {:.2}", named(a), a.variance));
    Ok(done
        .line("the most salient angles:")
        .lines(lines)
        .next(context.overcoat(&format!("drive STREAM --method laplacian --library {}", args.out.display()))))
}
