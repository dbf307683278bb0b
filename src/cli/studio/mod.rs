//! `overcoat studio`: generates a synthetic subject and its scans, with ground truth, and garments to try on.

mod error;
mod make;

use super::console::{Context, Done, Verbosity, print_aside, secs};
use crate::body::Grasp;
use crate::studio::{GarmentForm, GarmentKind, SubjectParams};
use clap::builder::{PossibleValuesParser, TypedValueParser};
pub use error::MakeError;
use make::{MakeRequest, make_garments, make_subject};
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
    /// Generate garments alone, in one or more sizes, as files to try on
    Garment(GarmentArgs),
    /// List the garments that can be generated
    Garments,
}

#[derive(clap::Args)]
struct GarmentArgs {
    /// The garment, as in `overcoat studio garments`
    #[arg(long, value_name = "KIND")]
    kind: String,
    /// Seed of the person that M is cut for, and of length and colours
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Sizes, XXS to XXL: one adds 4 cm to chest, waist and hip, 2.4 to a leg, 1.4 to a sleeve
    #[arg(long, value_name = "A,B,…", default_value = "M")]
    sizes: String,
    /// How the file shows it
    #[arg(long, value_enum, default_value_t = FormWord::Sheet)]
    form: FormWord,
    /// Folder to write: a new one, or an empty one
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum FormWord {
    /// One sheet of triangles
    Sheet,
    /// Two sheets 4 mm apart, joined at the hems
    Thick,
    /// One sheet, with buttons as parts of their own
    Buttoned,
    /// Four pieces that meet at seams without being joined
    Split,
    /// Mostly quads
    Quads,
}

impl From<FormWord> for GarmentForm {
    fn from(word: FormWord) -> Self {
        match word {
            FormWord::Sheet => Self::Sheet,
            FormWord::Thick => Self::Thick,
            FormWord::Buttoned => Self::Buttoned,
            FormWord::Split => Self::Split,
            FormWord::Quads => Self::Quads,
        }
    }
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
    /// Give every garment the colours of the first, as `coat,scarf` of one wool
    #[arg(long)]
    alike: bool,
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
    /// How the person holds the hands
    #[arg(long, value_name = "GRASP", value_parser = grasps(), default_value = "relaxed")]
    hands: Grasp,
    /// Simulate a camera without noise
    #[arg(long)]
    no_noise: bool,
    /// Give the fused scans a texture of N × N pixels, `K-NAME.jpg`, besides a colour per vertex
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(256..=8192))]
    texture: Option<u16>,
    /// Write the fused scans and the ground truth, but no frames
    #[arg(long)]
    no_frames: bool,
}

pub(super) fn run(args: StudioArgs, context: &Context) -> anyhow::Result<Done> {
    match args.action {
        StudioAction::Make(args) => make(args, context),
        StudioAction::Garment(args) => garment(&args),
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
            alike: args.alike,
            views: args.views,
            turns: args.turns,
            size: args.size,
            sway_mm: args.sway,
            faces: args.faces,
            noise: !args.no_noise,
            hands: args.hands,
        },
        frames: !args.no_frames,
        texture: args.texture.map(usize::from),
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

fn garment(args: &GarmentArgs) -> anyhow::Result<Done> {
    let began = Instant::now();
    let files = make_garments(&args.out, &args.kind, args.seed, &args.sizes, args.form.into())?;
    let json = json!({ "out": args.out.display().to_string(), "seed": args.seed, "files": files });
    let first = files.first().map(|file| file.file.display().to_string()).unwrap_or_default();
    Ok(Done::new("studio garment", json)
        .line(format!(
            "sewed {} in {}",
            if files.len() == 1 { "a garment" } else { "the sizes" },
            secs(began.elapsed())
        ))
        .lines(files.iter().map(|file| format!("  {:<4} {}", file.size, file.file.display())))
        .next(format!("overcoat -C DIR tryon {first}")))
}

fn garments() -> Done {
    let known = GarmentKind::ALL;
    let json = json!({ "garments": known.iter().map(|g| json!({ "name": g.name(), "template": g.template(), "about": g.about() })).collect::<Vec<_>>() });
    Done::new("studio garments", json).lines(known.iter().map(|g| format!("{:<12} {}", g.name(), g.about())))
}

fn grasps() -> impl TypedValueParser<Value = Grasp> {
    let named = |name: &str| Grasp::NAMED.into_iter().find(|(known, _)| *known == name);
    PossibleValuesParser::new(Grasp::NAMED.map(|(name, _)| name))
        .map(move |name| named(&name).map_or(Grasp::RELAXED, |(_, grasp)| grasp))
}

fn size(text: &str) -> Result<[usize; 2], String> {
    let numbers = text.split_once('x').and_then(|(w, h)| Some([w.trim().parse().ok()?, h.trim().parse().ok()?]));
    numbers.ok_or_else(|| "expected width and height in pixels, such as 424x512".into())
}
