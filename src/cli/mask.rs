//! `overcoat mask`: correct a garment's labels.

use super::console::{Context, Done, secs};
use crate::session::{MaskInfo, SessionError};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(super) struct MaskArgs {
    /// The garment
    #[arg(required = true)]
    layer: Option<String>,
    /// Brush strokes (.jsonl), labels (.npy, .ply as painted in Blender or MeshLab), or a picture over the scan's texture
    /// coordinates (.png); a file that is already a mask of the garment replaces itself
    #[arg(required_unless_present = "template")]
    file: Option<PathBuf>,
    /// The garment's class in a file with labels of several classes (.npy, or .ply with `label`); several as 3,4. Every other
    /// class is not the garment, and a negative one is unlabelled
    #[arg(long, value_name = "N", value_delimiter = ',', requires = "file")]
    class: Vec<i64>,
    /// Write the segmented scan for painting: .ply (red is the garment), .png over its texture coordinates (white is the
    /// garment), .npy, or an empty .jsonl
    #[arg(long, value_name = "OUT", conflicts_with = "file")]
    template: Option<PathBuf>,
    /// With --template: replace a file that Overcoat did not write, or that was painted since
    #[arg(long, requires = "template")]
    force: bool,
    #[command(subcommand)]
    command: Option<MaskCommand>,
}

#[derive(clap::Subcommand)]
enum MaskCommand {
    /// List the masks
    List {
        /// Those of this garment only
        layer: Option<String>,
    },
    /// Remove a mask from a garment
    Remove {
        /// The garment
        layer: String,
        /// The mask's file, or its number in the list
        #[arg(required_unless_present = "all")]
        mask: Option<String>,
        /// All masks of the garment
        #[arg(long, conflicts_with = "mask")]
        all: bool,
    },
}

pub(super) fn run(args: MaskArgs, context: &Context) -> anyhow::Result<Done> {
    let classes = args.class;
    match (args.command, args.layer, args.file, args.template) {
        (Some(MaskCommand::List { layer }), ..) => list(layer.as_deref(), context),
        (Some(MaskCommand::Remove { layer, mask, .. }), ..) => remove(&layer, mask.as_deref(), context),
        (None, Some(layer), Some(file), _) => add(&layer, file, &classes, context),
        (None, Some(layer), None, Some(target)) => template(&layer, target, args.force, context),
        // The parser has already checked that the argument is present.
        _ => {
            Err(SessionError::BadRequest { what: "mask needs a garment and a file".into(), hint: String::new() }.into())
        }
    }
}

fn add(layer: &str, file: PathBuf, classes: &[i64], context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let file = context.input(file);
    let report = context.writer()?.add_mask(layer, &file, classes)?;
    let json = json!({
        "session": context.session.display().to_string(),
        "layer": layer,
        "file": file.display().to_string(),
        "added_vertices": report.added,
        "erased_vertices": report.erased,
        "replaced": report.replaced,
        "pins_all": report.pins_all,
        "secs": began.elapsed().as_secs_f64(),
    });
    Ok(Done::new("mask", json)
        .line(format!(
            "marked {} vertices of the scan as {layer} and {} as not {layer}{}, in {}",
            report.added,
            report.erased,
            if report.replaced { ", replacing what the file marked before" } else { "" },
            secs(began.elapsed())
        ))
        .lines((report.added + report.erased == 0).then(|| {
            "  nothing in it differs from the labels as they are: paint the file and give it again".to_string()
        }))
        .lines(report.pins_all.then(|| format!("  all labels of the file are pinned: {}", why_all(layer, &file))))
        .next(context.overcoat("build")))
}

/// Why a mask pins the labels of the whole scan.
fn why_all(layer: &str, file: &Path) -> String {
    let ends_in = |extension: &str| file.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension));
    match (ends_in("npy"), ends_in("png")) {
        (true, _) => "write -1 for a vertex that is to follow the template".into(),
        (_, true) => "make transparent what is to follow the template".into(),
        _ => format!("{layer} was never built, so there are none to compare them with"),
    }
}

fn template(layer: &str, target: PathBuf, force: bool, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let session = context.reader()?;
    let mut outputs = session.outputs(force);
    let vertices = session.write_mask_template(layer, &target, &mut outputs)?;
    context.console.notices(outputs.notices());
    let json = json!({
        "session": context.session.display().to_string(),
        "layer": layer,
        "template": target.display().to_string(),
        "vertices": vertices,
        "secs": began.elapsed().as_secs_f64(),
    });
    let painted = target.display().to_string();
    let line = match painted.ends_with(".jsonl") {
        true => format!("wrote {painted}, for strokes, in {}", secs(began.elapsed())),
        false => format!("wrote {painted}: the labels of {vertices} vertices, in {}", secs(began.elapsed())),
    };
    Ok(Done::new("mask", json).line(line).next(context.overcoat(&format!("mask {layer} {painted}"))))
}

fn list(layer: Option<&str>, context: &Context) -> anyhow::Result<Done> {
    let masks = context.reader()?.masks(layer)?;
    let json = json!({ "session": context.session.display().to_string(), "masks": masks });
    let line = |m: &MaskInfo| {
        format!("{:<12} {}  {:<28} {}: {} added, {} erased", m.layer, m.number, m.file, m.kind, m.added, m.erased)
    };
    let done = Done::new("mask list", json);
    Ok(match masks.is_empty() {
        true => done.line("no masks").next(context.overcoat("mask LAYER FILE")),
        false => done.lines(masks.iter().map(line)),
    })
}

fn remove(layer: &str, mask: Option<&str>, context: &Context) -> anyhow::Result<Done> {
    let gone = context.writer()?.remove_mask(layer, mask)?;
    let json = json!({ "session": context.session.display().to_string(), "layer": layer, "removed": gone });
    Ok(Done::new("mask remove", json)
        .line(format!("{} no longer corrects {layer}", gone.join(", ")))
        .next(context.overcoat("build")))
}
