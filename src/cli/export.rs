//! `overcoat export`: writes the figure or a step as files.

use super::console::{Context, Done, Progress, Verbosity, secs};
use crate::export::{Bones, Check, Engine, FileAxes, RemeshedLayer, RemovedPart, Rest};
use crate::geometry::QuadFigures;
use crate::scan::{Unit, Up};
use crate::session::{ExportRequest, ExportStep, Faces, SequenceKind, SequenceRequest, TextureSize, Textures};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct ExportArgs {
    /// `NAME.glb`, .gltf, .vrm, .usda, .usdc, .usdz or .obj; a folder for one .ply per layer; .npz for shape and poses of an SMPL body
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
    /// Export the frames of an animation to a new folder: `ply`, one mesh per frame and layer; `pc2`, one point cache per layer
    #[arg(long, value_name = "ply|pc2", value_parser = sequence_kind, conflicts_with_all = ["at", "scan", "stage"])]
    sequence: Option<SequenceKind>,
    /// With --sequence: the animation; by default the last one
    #[arg(long, value_name = "NAME", requires = "sequence")]
    clip: Option<String>,
    /// Only these layers, by their names
    #[arg(long, value_name = "LAYER,…", value_delimiter = ',', conflicts_with_all = ["scan", "stage", "sequence"])]
    layers: Vec<String>,
    /// Remove what other layers cover in every pose, except for a margin of 20 mm, so that it does not poke through them
    #[arg(long, conflicts_with_all = ["scan", "stage", "sequence"])]
    hide_covered: bool,
    /// The most joints that move a vertex of a .glb, .gltf or USD file: with 4, which every program reads, cloth at shoulders and hips may lie up to 2 cm from where 8 put it
    #[arg(long, value_name = "4|8", default_value = "4", value_parser = ["4", "8"], conflicts_with_all = ["scan", "stage", "sequence"])]
    influences: String,
    /// About so many faces in all layers together, on average at least 1000 each: the textures stay as sharp; where a layer would cross another, it keeps more
    #[arg(long, value_name = "COUNT", value_parser = face_count, conflicts_with_all = ["at", "scan", "stage", "sequence", "quads", "bake_cloth"])]
    faces: Option<usize>,
    /// Quads that follow the cloth instead of triangles, about so many in all; by default as fine as the triangles
    #[arg(long, value_name = "COUNT", num_args = 0..=1, require_equals = true, conflicts_with_all = ["at", "scan", "stage", "sequence", "hide_covered", "bake_cloth"])]
    quads: Option<Option<usize>>,
    /// The side of each layer's texture in pixels, 2k by default; with `none`, vertices have colours instead
    #[arg(long, value_name = "1k|2k|4k|none", value_parser = texture, conflicts_with_all = ["scan", "stage", "sequence"])]
    texture: Option<Textures>,
    /// Add a normal map to each layer that has fewer faces than its scan, in a .glb, .gltf or USD file, of the textures' size
    #[arg(long, conflicts_with_all = ["scan", "stage", "sequence"])]
    normal_map: bool,
    /// Add to a .glb what this program's cloth needs: masks as vertex colours, coefficients as JSON, or a script
    #[arg(long = "for", value_name = "unreal|unity|blender", value_parser = engine, conflicts_with_all = ["scan", "stage", "sequence"])]
    engine: Option<Engine>,
    /// Who made the figure, for the .vrm, which has to say so; may be given several times
    #[arg(long, value_name = "NAME", conflicts_with_all = ["at", "scan", "stage", "sequence"])]
    author: Vec<String>,
    /// Write the simulated cloth of an animation frame by frame: into USD as time samples, into a .glb or .gltf as morph targets; by default the last animation
    #[arg(long, value_name = "ANIMATION", num_args = 0..=1, require_equals = true, conflicts_with_all = ["at", "scan", "stage", "sequence", "hide_covered"])]
    bake_cloth: Option<Option<String>>,
    /// The axes of the bones in a file of the character: `limbs`, along them, as Blender draws bones; `up`, all as the world's
    #[arg(long, value_name = "limbs|up", default_value = "limbs", value_parser = ["limbs", "up"], conflicts_with_all = ["scan", "stage", "sequence"])]
    bones: String,
    /// The bind pose of a file of the character: `bind`, that of the body model; `t`, arms level; `a`, arms halfway down. A .vrm is in the T-pose
    #[arg(long, value_name = "bind|t|a", value_parser = rest, conflicts_with_all = ["scan", "stage", "sequence"])]
    rest: Option<Rest>,
    /// The axis that points up in a USD or .obj file, or in the .ply files of a folder; with z the figure faces -Y
    #[arg(long, value_name = "y|z", default_value = "y", value_parser = ["y", "z"], conflicts_with_all = ["at", "scan", "stage", "sequence"])]
    up: String,
    /// The unit of a USD or .obj file, or of the .ply files of a folder
    #[arg(long, value_name = "m|cm", default_value = "m", value_parser = ["m", "cm"], conflicts_with_all = ["at", "scan", "stage", "sequence"])]
    unit: String,
    /// The character's name in the file, `figure` by default
    #[arg(long, conflicts_with_all = ["scan", "stage", "sequence"])]
    name: Option<String>,
    /// Write nothing, and list what importers demand of such a file and whether it is so; an export always checks that
    #[arg(long, conflicts_with_all = ["scan", "stage", "sequence"])]
    lint: bool,
    /// Replace files that Overcoat did not write, or that were changed since
    #[arg(long, conflicts_with = "sequence")]
    force: bool,
}

fn sequence_kind(text: &str) -> Result<SequenceKind, String> {
    match text {
        "ply" => Ok(SequenceKind::Ply),
        "pc2" => Ok(SequenceKind::Pc2),
        _ => Err("give ply or pc2".into()),
    }
}

fn engine(text: &str) -> Result<Engine, String> {
    match text {
        "unreal" => Ok(Engine::Unreal),
        "unity" => Ok(Engine::Unity),
        "blender" => Ok(Engine::Blender),
        _ => Err("give unreal, unity or blender".into()),
    }
}

/// `20k` or `20000`.
fn face_count(text: &str) -> Result<usize, String> {
    let (number, factor) = text.strip_suffix(['k', 'K']).map_or((text, 1), |number| (number, 1000));
    let count = number.parse::<usize>().ok().and_then(|number| number.checked_mul(factor));
    count.ok_or_else(|| "give a number such as 20k or 20000".into())
}

fn rest(text: &str) -> Result<Rest, String> {
    match text {
        "bind" => Ok(Rest::Bind),
        "t" => Ok(Rest::TPose),
        "a" => Ok(Rest::APose),
        _ => Err("give bind, t or a".into()),
    }
}

fn texture(text: &str) -> Result<Textures, String> {
    match text {
        "1k" => Ok(Textures::Of(TextureSize::Small)),
        "2k" => Ok(Textures::Of(TextureSize::Medium)),
        "4k" => Ok(Textures::Of(TextureSize::Large)),
        "none" => Ok(Textures::None),
        _ => Err("give 1k, 2k, 4k or none".into()),
    }
}

/// The frames of an animation.
fn export_frames(request: &SequenceRequest, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let session = context.reader()?;
    let mut progress = Progress::of_one_stage(&context.console);
    let mut on_frame = |frame, count| progress.describe(format!("frame {frame} of {count}"));
    let files = session.export_sequence(request, &mut on_frame)?;
    progress.end();
    let json = json!({
        "session": context.session.display().to_string(),
        "target": request.target.display().to_string(),
        "files": files.iter().map(|f| f.display().to_string()).collect::<Vec<_>>(),
        "secs": began.elapsed().as_secs_f64(),
    });
    let line = format!("wrote {} files in {} to {}", files.len(), secs(began.elapsed()), request.target.display());
    Ok(Done::new("export", json).line(line))
}

pub(super) fn run(args: ExportArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    if let Some(kind) = args.sequence {
        let request = SequenceRequest { target: args.target, kind, animation: args.clip };
        return export_frames(&request, context);
    }
    let request = ExportRequest {
        target: args.target,
        at: args.at,
        scan: args.scan,
        before_registration: args.stage.is_some(),
        layers: args.layers,
        hide_covered: args.hide_covered,
        eight_influences: args.influences == "8",
        engine: args.engine,
        authors: args.author,
        bake_cloth: args.bake_cloth,
        bones: if args.bones == "up" { Bones::Up } else { Bones::AlongLimbs },
        rest: args.rest,
        axes: FileAxes {
            up: if args.up == "z" { Up::PlusZ } else { Up::PlusY },
            unit: if args.unit == "cm" { Unit::Centimetre } else { Unit::Metre },
        },
        name: args.name,
        normal_map: args.normal_map,
        textures: args.texture.unwrap_or_default(),
        lint: args.lint,
        faces: match (args.faces, args.quads) {
            (Some(count), _) => Faces::Fewer(count),
            (None, Some(count)) => Faces::Quads(count),
            (None, None) => Faces::AsBuilt,
        },
    };
    let session = context.reader()?;
    let mut outputs = session.outputs(args.force);
    let mut progress = Progress::of_one_stage(&context.console);
    let mut on_step = |step: ExportStep| match step {
        ExportStep::Texture(layer) => progress.describe(format!("texture of {layer}")),
        ExportStep::NormalMap(layer) => progress.describe(format!("normal map of {layer}")),
        ExportStep::BakedCloth { animation, frames, bytes } => {
            progress.say(&format!("the cloth of '{animation}' in {frames} frames: writing {}", size(bytes)));
        }
    };
    let exported = session.export(&request, &mut outputs, &mut on_step)?;
    progress.end();
    context.console.notices(outputs.notices());
    let shown: Vec<String> = exported.files.iter().map(|f| f.display().to_string()).collect();
    let mut json = json!({
        "session": context.session.display().to_string(),
        "target": request.target.display().to_string(),
        "files": shown,
        "secs": began.elapsed().as_secs_f64(),
    });
    let mut lines = Vec::new();
    if request.hide_covered {
        let entry = |part: &RemovedPart| json!({ "layer": part.layer, "removed_percent": percent(&[part]) });
        json["removed"] = exported.removed.iter().map(entry).collect();
        lines = removed_lines(&exported.removed, context.console.verbosity);
    }
    if !exported.remeshed.is_empty() {
        let key = if matches!(request.faces, Faces::Quads(_)) { "quads" } else { "faces" };
        json[key] = exported.remeshed.iter().map(remeshed_json).collect();
        lines.extend(exported.remeshed.iter().filter_map(remeshed_line));
    }
    if request.lint {
        json["checks"] = exported.checks.iter().map(check_json).collect();
        let lines = exported.checks.iter().flat_map(check_lines).chain(lines);
        let bad = exported.checks.iter().filter(|check| !check.faults.is_empty()).count();
        let done = Done::new("export", json).lines(lines);
        return Ok(match bad {
            0 => done.line(format!("{} checks, no fault; nothing was written", exported.checks.len())),
            _ => done.failed(
                format!("{bad} of {} checks found faults", exported.checks.len()),
                "leave --lint out to write the file all the same",
            ),
        });
    }
    let count = match shown.len() {
        1 => "1 file".to_string(),
        n => format!("{n} files"),
    };
    Ok(Done::new("export", json)
        .line(format!("wrote {count} in {}", secs(began.elapsed())))
        .lines(shown.iter().map(|f| format!("  {f}")))
        .lines(lines)
        .next(context.overcoat("view --sheet sheet.png")))
}

/// Bytes in words.
fn size(bytes: usize) -> String {
    match bytes {
        0..1_000_000 => format!("{} kB", bytes.div_ceil(1000)),
        _ => format!("{} MB", bytes.div_ceil(1_000_000)),
    }
}

/// A check, and below it its faults.
fn check_lines(check: &Check) -> Vec<String> {
    let mark = if check.faults.is_empty() { "ok " } else { "bad" };
    let faults = check.faults.iter().map(|fault| format!("      {fault}"));
    std::iter::once(format!("{mark}   {}", check.what)).chain(faults).collect()
}

fn check_json(check: &Check) -> Value {
    json!({ "what": check.what, "faults": check.faults })
}

/// The new faces of a layer; a layer that keeps its triangles has a notice instead.
fn remeshed_line(layer: &RemeshedLayer) -> Option<String> {
    let remeshed = layer.outcome.as_ref().ok()?;
    let name = &layer.name;
    let finer = if remeshed.is_finer { ", finer because larger ones would cross or lose a part" } else { "" };
    let Some(QuadFigures { quads, singular_vertices, smallest_angle_deg, poor_quads, .. }) = remeshed.quads else {
        let (now, before, far) = (remeshed.triangles, layer.triangles_before, remeshed.farthest * 1000.0);
        return Some(format!("{name}: {now} of {before} triangles, {far:.1} mm away at most{finer}"));
    };
    let angles = match poor_quads {
        0 => format!("angles from {smallest_angle_deg:.0}°"),
        1 => "1 has an angle below 20°".to_string(),
        n => format!("{n} have angles below 20°"),
    };
    Some(format!("{name}: {quads} quads, {singular_vertices} singular vertices, {angles}{finer}"))
}

fn remeshed_json(layer: &RemeshedLayer) -> Value {
    let remeshed = match &layer.outcome {
        Err(reason) => return json!({ "layer": layer.name, "keeps_triangles": reason }),
        Ok(remeshed) => remeshed,
    };
    let mut json = json!({
        "layer": layer.name,
        "triangles_before": layer.triangles_before,
        "triangles": remeshed.triangles,
        "is_finer": remeshed.is_finer,
        "farthest_mm": remeshed.farthest * 1000.0,
    });
    if let Some(figures) = &remeshed.quads {
        json["quads"] = json!(figures.quads);
        json["singular_vertices"] = json!(figures.singular_vertices);
        json["poor_quads"] = json!(figures.poor_quads);
        json["smallest_angle_deg"] = json!(figures.smallest_angle_deg);
        json["edge_length_mm"] = json!(figures.edge_length * 1000.0);
    }
    json
}

/// What was removed: a line per layer, or one for all.
fn removed_lines(removed: &[RemovedPart], verbosity: Verbosity) -> Vec<String> {
    if verbosity >= Verbosity::Verbose {
        return removed
            .iter()
            .map(|part| format!("{}: removed {:.1} % of its area", part.layer, percent(&[part])))
            .collect();
    }
    let cut: Vec<&RemovedPart> = removed.iter().filter(|part| part.removed_area > 0.0).collect();
    vec![match cut.len() {
        0 => "no layer is covered in every pose; nothing was removed".to_string(),
        count => format!(
            "removed what is covered in every pose: {:.0} % of the area, from {count} of {} layers",
            percent(&removed.iter().collect::<Vec<_>>()),
            removed.len()
        ),
    }]
}

/// The share of the parts' area that was removed.
fn percent(parts: &[&RemovedPart]) -> f64 {
    let sum = |of: fn(&RemovedPart) -> f64| parts.iter().map(|part| of(part)).sum::<f64>();
    // An empty sum is minus zero, which would be printed so.
    100.0 * sum(|part| part.removed_area) / sum(|part| part.area).max(f64::MIN_POSITIVE) + 0.0
}
