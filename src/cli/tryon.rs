//! `overcoat tryon`: put a garment from a file onto the figure.

use super::console::{Context, Done, Progress, secs, verdicts};
use crate::scan::Unit;
use crate::session::{
    ClipFrame, Content, Forced, NewScan, Outputs, Session, SessionError, SizedFile, StepStatus, TriedPose, TryOnMethod,
    girth_notes,
};
use crate::tryon::{Secs, Stop, Switches};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct TryOnArgs {
    /// The garment's mesh: .obj, .ply, .glb, .gltf, .stl or .off, in any unit and frame
    #[arg(value_name = "GARMENT", required_unless_present = "size")]
    file: Option<PathBuf>,
    /// Try sizes of a garment, as in --size S=s.obj --size M=m.obj: each is put on and gets a verdict; the session does not
    /// change unless one is kept
    #[arg(long, value_name = "SIZE=FILE", conflicts_with_all = ["file", "stop_after"])]
    size: Vec<SizedFile>,
    /// With --size: this one becomes a layer
    #[arg(long, value_name = "SIZE", requires = "size")]
    keep: Option<String>,
    /// The garment kind, as in `overcoat templates list`; by default what its openings say
    #[arg(short, long, value_name = "KIND")]
    template: Option<String>,
    /// What it is made of, as in `templates/fabrics.toml`: jersey, cotton, denim, …; by default what its kind usually is
    #[arg(long)]
    fabric: Option<String>,
    /// How it is put on: `grown`, the figure grows in it, without a crossing on the way; `paper`, the steps of Shi 2020, then our
    /// solver
    #[arg(long, value_enum, default_value_t = MethodWord::Grown, conflicts_with = "size")]
    method: MethodWord,
    /// Name of the step and of the layer; by default that of its kind
    #[arg(long)]
    name: Option<String>,
    /// Unit of the file (m, dm, cm, mm, in); by default the one that makes its openings fit an adult
    #[arg(long)]
    unit: Option<Unit>,
    /// Replace the step of that name
    #[arg(long)]
    replace: bool,
    /// Only take the garment through the steps of Shi 2020, up to this one: rims, parts, skeleton, orient, bend, move or clear;
    /// the session does not change
    #[arg(long, value_name = "STEP", value_parser = step, conflicts_with_all = ["template", "fabric", "name", "replace", "method"])]
    stop_after: Option<Stop>,
    /// With --stop-after: a picture of all steps. With --size or --pose: the air below the garment, as colours
    #[arg(long, value_name = "FILE.png")]
    picture: Option<PathBuf>,
    /// With --stop-after: the garment as the last step left it. With --pose: in that pose
    #[arg(long, value_name = "FILE.ply", conflicts_with = "size")]
    mesh: Option<PathBuf>,
    /// Put it on in this pose, a frame of a clip, such as walk:60; the session does not change. With --stop-after: the steps in it
    #[arg(long, value_name = "CLIP:FRAME", conflicts_with_all = ["size", "name", "replace", "method"])]
    pose: Option<ClipFrame>,
    /// With --stop-after: leave out parts of the method, to see what they are good for
    #[arg(long, value_enum, value_delimiter = ',', value_name = "A,B", requires = "stop_after")]
    without: Vec<Without>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum MethodWord {
    Grown,
    Paper,
}

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Without {
    /// The boundary planes between torso and limbs
    Planes,
    /// The turn into the figure's heading
    Orient,
    /// The torso's skeleton
    Torso,
}

fn step(name: &str) -> Result<Stop, String> {
    let known = || Stop::ALL.map(|(name, _)| name).join(", ");
    Stop::from_name(name).ok_or_else(|| format!("there are {}", known()))
}

/// Sizes side by side; one may be kept.
fn try_sizes(mut args: TryOnArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let kept = match &args.keep {
        None => None,
        Some(keep) => match args.size.iter().find(|sized| sized.size == *keep) {
            Some(sized) => Some(sized.file.clone()),
            None => {
                let sizes: Vec<&str> = args.size.iter().map(|sized| sized.size.as_str()).collect();
                return Err(SessionError::BadRequest {
                    what: format!("there is no size {keep} to keep"),
                    hint: format!("give --keep with one of {}", sizes.join(", ")),
                }
                .into());
            }
        },
    };
    let session = context.reader()?;
    let mut outputs = session.outputs(args.force);
    args.size.iter().for_each(|sized| outputs.protect(&sized.file, "is a garment"));
    args.picture.iter().try_for_each(|path| outputs.claim(path, Content::Picture))?;
    let mut progress = Progress::of_one_stage(&context.console);
    let how = (args.template.as_deref(), args.fabric.as_deref());
    let tried = session.try_sizes(&args.size, args.unit, how, &mut |size| progress.describe(format!("size {size}")))?;
    progress.end();
    if let Some(path) = &args.picture {
        tried.write_picture(path, &mut outputs)?;
    }
    context.console.notices(outputs.notices());
    let each = tried.sizes.iter().map(|tried| {
        json!({
            "size": tried.sized.size,
            "file": tried.sized.file.display().to_string(),
            "verdict": tried.verdict,
            "verdict_text": tried.verdict.to_string(),
            "girths": tried.ease.girths,
            "length": tried.ease.length,
            "fell": tried.worn.fell,
            "skin_gave_way": tried.worn.gave_way,
            "notes": tried.notes,
        })
    });
    let sizes: Vec<serde_json::Value> = each.collect();
    let picture = args.picture.take();
    let lines = tried.sizes.iter().flat_map(|tried| {
        let girths = girth_notes(&tried.ease).into_iter().map(|note| format!("    {}", note.replace('\t', ": ")));
        std::iter::once(format!("  {}: {}", tried.sized.size, tried.verdict)).chain(girths)
    });
    let lines: Vec<String> = std::iter::once(format!(
        "tried {} sizes of {} ({}), in {}",
        sizes.len(),
        tried.kind,
        tried.fabric,
        secs(began.elapsed())
    ))
    .chain(lines)
    .chain(picture.iter().map(|path| format!("drew {}", path.display())))
    .collect();
    let Some(file) = kept else {
        let json = json!({ "kind": tried.kind, "fabric": tried.fabric, "sizes": sizes });
        let again = args.size.iter().map(|sized| format!("--size {}={} ", sized.size, sized.file.display()));
        let keep = format!("tryon {}--keep SIZE", again.collect::<String>());
        return Ok(Done::new("tryon", json).lines(lines).next(context.overcoat(&keep)));
    };
    args.template.get_or_insert(tried.kind.clone());
    let mut done = put_on(args, file, context)?;
    done.json.insert("sizes".into(), sizes.into());
    done.lines.splice(0..0, lines);
    Ok(done)
}

/// The picture and the mesh may be written, and the garment is not overwritten.
fn claimed(args: &TryOnArgs, garment: &Path, session: &Session) -> Result<Outputs, SessionError> {
    let mut outputs = session.outputs(args.force);
    outputs.protect(garment, "is the garment");
    for (path, content) in [(&args.picture, Content::Picture), (&args.mesh, Content::Mesh)] {
        path.iter().try_for_each(|path| outputs.claim(path, content))?;
    }
    Ok(outputs)
}

/// The garment in a pose, without a change of the session.
fn try_pose(args: &TryOnArgs, frame: &ClipFrame, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let file = args.file.clone().unwrap_or_default();
    let session = context.reader()?;
    let mut outputs = claimed(args, &file, &session)?;
    let mut progress = Progress::of_one_stage(&context.console);
    progress.describe("putting it on".into());
    let how = (args.template.as_deref(), args.fabric.as_deref());
    let tried = session.try_pose(&file, args.unit, how, frame)?;
    progress.end();
    if let Some(path) = &args.picture {
        tried.write_picture(path, &mut outputs)?;
    }
    if let Some(path) = &args.mesh {
        tried.write_mesh(path, &mut outputs)?;
    }
    context.console.notices(outputs.notices());
    let TriedPose { kind, fabric, posed, crossing_clothes, notes } = &tried;
    let crossing_pairs = posed.crossing_pairs();
    let json = json!({
        "file": file.display().to_string(),
        "kind": kind,
        "fabric": fabric,
        "crossing_pairs": crossing_pairs,
        "crossing_clothes": crossing_clothes,
        "skin_gave_way": posed.gave_way,
        "notes": notes,
        "secs": began.elapsed().as_secs_f64(),
    });
    let mut done = Done::new("tryon", json)
        .line(format!(
            "put {} ({kind}, {fabric}) on in frame {} of '{}', in {}; the session is unchanged",
            file.display(),
            frame.frame,
            frame.clip,
            secs(began.elapsed())
        ))
        .line(format!("{crossing_pairs} pairs of faces cross; skin gives way by up to {:.0} mm", 1e3 * posed.gave_way))
        .lines(notes.iter().map(|note| format!("  {note}")));
    if *crossing_clothes > 0 {
        done = done.line(format!(
            "{crossing_clothes} pairs cross what the figure wears below: only a layer is cleared of what hangs loose there"
        ));
    }
    for path in args.picture.iter().chain(&args.mesh) {
        done = done.line(format!("wrote {}", path.display()));
    }
    Ok(done.next(context.overcoat(&format!("tryon {}", file.display()))))
}

/// The steps of the paper, without a change of the session.
fn try_steps(args: &TryOnArgs, stop: Stop, context: &Context) -> anyhow::Result<Done> {
    let file = args.file.clone().unwrap_or_default();
    let session = context.reader()?;
    let mut outputs = claimed(args, &file, &session)?;
    let leaves_out = |part| args.without.contains(&part);
    let switches = Switches {
        refine: !leaves_out(Without::Planes),
        orient: !leaves_out(Without::Orient),
        torso: !leaves_out(Without::Torso),
        stop,
    };
    let tried = session.try_steps(&file, args.unit, args.pose.as_ref(), switches)?;
    if let Some(path) = &args.picture {
        tried.write_picture(path, &mut outputs)?;
    }
    if let Some(path) = &args.mesh {
        tried.write_mesh(path, &mut outputs)?;
    }
    context.console.notices(outputs.notices());
    let Secs { segmentation, deformation, removal } = tried.steps.secs;
    let json = json!({
        "file": file.display().to_string(),
        "stopped_after": stop.name(),
        "inside": tried.inside(),
        "secs": { "segmentation": segmentation, "deformation": deformation, "removal": removal },
        "notes": tried.notes,
    });
    let ms = |secs: f64| format!("{:.0} ms", 1e3 * secs);
    let mut done = Done::new("tryon", json)
        .line(format!("tried {} up to the step '{}'; the session is unchanged", file.display(), stop.name()))
        .line(format!(
            "segmentation {}, deformation {}, removal of interpenetration {}",
            ms(segmentation),
            ms(deformation),
            ms(removal)
        ));
    if let Some([before, after]) = tried.inside() {
        done = done.line(format!("{before} vertices were inside the body, {after} are"));
    }
    done = done.lines(tried.notes.iter().map(|note| format!("  {note}")));
    for path in args.picture.iter().chain(&args.mesh) {
        done = done.line(format!("wrote {}", path.display()));
    }
    Ok(done.next(context.overcoat(&format!("tryon {}", file.display()))))
}

pub(super) fn run(mut args: TryOnArgs, context: &Context) -> anyhow::Result<Done> {
    let is_layer = args.stop_after.is_none() && args.pose.is_none();
    if is_layer && args.picture.is_some() && args.size.is_empty() {
        return Err(SessionError::BadRequest {
            what: "--picture draws the steps of the paper, a pose, or sizes".into(),
            hint: "add --stop-after, --pose or --size; `view --sheet` draws the garment as a layer".into(),
        }
        .into());
    }
    if is_layer && args.mesh.is_some() {
        return Err(SessionError::BadRequest {
            what: "--mesh writes the garment after steps of the paper, or in a pose".into(),
            hint: "add --stop-after or --pose; `export DIR/` writes the garment as a layer".into(),
        }
        .into());
    }
    if let Some(stop) = args.stop_after {
        return try_steps(&args, stop, context);
    }
    if let Some(frame) = args.pose.take() {
        return try_pose(&args, &frame, context);
    }
    match args.file.take() {
        Some(file) => put_on(args, file, context),
        None => try_sizes(args, context),
    }
}

/// The garment becomes a layer.
fn put_on(args: TryOnArgs, file: PathBuf, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let new = NewScan {
        name: args.name.unwrap_or_default(),
        file: context.input(file),
        template: args.template,
        unit: args.unit,
        fabric: args.fabric,
        method: (args.method == MethodWord::Paper).then_some(TryOnMethod::Paper),
        replace: args.replace,
        ..NewScan::default()
    };
    let mut writer = context.writer()?;
    let mut progress = Progress::of_stages(&context.console, writer.session().stage_count());
    let (name, report) = writer.add_garment(&new, &mut |event| progress.show(event))?;
    let built = writer.build(&Forced::Nothing, &mut |event| progress.show(event));
    progress.end();
    // Of the garment alone: a step before it may have failed, which the verdict says.
    let status = writer.session().status()?;
    let own = status.into_iter().filter(|step| step.name == name && step.out_of_date.is_empty());
    let own: Vec<_> = own.filter_map(StepStatus::into_verdict).collect();
    if own.is_empty() {
        built?;
    }
    let json = json!({
        "session": context.session.display().to_string(),
        "step": name,
        "file": new.file.display().to_string(),
        "findings": report.findings,
        "steps": own,
        "secs": began.elapsed().as_secs_f64(),
    });
    let done = Done::new("tryon", json)
        .line(format!("put {} on as '{name}', in {}", new.file.display(), secs(began.elapsed())))
        .lines(report.findings.iter().map(|finding| format!("  {finding}")));
    Ok(verdicts::required_unfailed(done, &own, context)
        .next(context.overcoat("view --sheet sheet.png"))
        .next(context.overcoat("export character.glb"))
        .next(context.overcoat("undo")))
}
