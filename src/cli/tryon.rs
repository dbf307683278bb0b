//! `overcoat tryon`: put a garment from a file onto the figure.

use super::console::{Context, Done, Progress, secs, verdicts};
use crate::scan::Unit;
use crate::session::{Built, ClipFrame, Content, Forced, NewScan};
use crate::tryon::{Secs, Stop, Switches};
use serde_json::json;
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct TryOnArgs {
    /// The garment's mesh: .obj, .ply, .glb, .gltf, .stl or .off, in any unit and frame
    #[arg(value_name = "GARMENT")]
    file: PathBuf,
    /// The garment kind, as in `overcoat templates list`; by default what its openings say
    #[arg(short, long, value_name = "KIND")]
    template: Option<String>,
    /// What it is made of, as in `templates/fabrics.toml`: jersey, cotton, denim, …; by default what its kind usually is
    #[arg(long)]
    fabric: Option<String>,
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
    #[arg(long, value_name = "STEP", value_parser = step, conflicts_with_all = ["template", "fabric", "name", "replace"])]
    stop_after: Option<Stop>,
    /// With --stop-after: a picture of all steps
    #[arg(long, value_name = "FILE.png", requires = "stop_after")]
    picture: Option<PathBuf>,
    /// With --stop-after: the garment as the last step left it
    #[arg(long, value_name = "FILE.ply", requires = "stop_after")]
    mesh: Option<PathBuf>,
    /// With --stop-after: the figure's pose, a frame of a clip, such as walk:60; by default the bind pose
    #[arg(long, value_name = "CLIP:FRAME", requires = "stop_after")]
    pose: Option<ClipFrame>,
    /// With --stop-after: leave out parts of the method, to see what they are good for
    #[arg(long, value_enum, value_delimiter = ',', value_name = "A,B", requires = "stop_after")]
    without: Vec<Without>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
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

/// The steps of the paper, without a change of the session.
fn try_steps(args: &TryOnArgs, stop: Stop, context: &Context) -> anyhow::Result<Done> {
    let session = context.reader()?;
    let mut outputs = session.outputs(args.force);
    outputs.protect(&args.file, "is the garment");
    for (path, content) in [(&args.picture, Content::Picture), (&args.mesh, Content::Mesh)] {
        path.iter().try_for_each(|path| outputs.claim(path, content))?;
    }
    let leaves_out = |part| args.without.contains(&part);
    let switches = Switches {
        refine: !leaves_out(Without::Planes),
        orient: !leaves_out(Without::Orient),
        torso: !leaves_out(Without::Torso),
        stop,
    };
    let tried = session.try_steps(&args.file, args.unit, args.pose.as_ref(), switches)?;
    if let Some(path) = &args.picture {
        tried.write_picture(path, &mut outputs)?;
    }
    if let Some(path) = &args.mesh {
        tried.write_mesh(path, &mut outputs)?;
    }
    context.console.notices(outputs.notices());
    let Secs { segmentation, deformation, removal } = tried.steps.secs;
    let json = json!({
        "file": args.file.display().to_string(),
        "stopped_after": stop.name(),
        "inside": tried.inside(),
        "secs": { "segmentation": segmentation, "deformation": deformation, "removal": removal },
        "notes": tried.notes,
    });
    let ms = |secs: f64| format!("{:.0} ms", 1e3 * secs);
    let mut done = Done::new("tryon", json)
        .line(format!("tried {} up to the step '{}'; the session is unchanged", args.file.display(), stop.name()))
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
    Ok(done.next(context.overcoat(&format!("tryon {}", args.file.display()))))
}

pub(super) fn run(args: TryOnArgs, context: &Context) -> anyhow::Result<Done> {
    if let Some(stop) = args.stop_after {
        return try_steps(&args, stop, context);
    }
    let began = Instant::now();
    let new = NewScan {
        name: args.name.unwrap_or_default(),
        file: context.input(args.file),
        template: args.template,
        unit: args.unit,
        fabric: args.fabric,
        replace: args.replace,
        ..NewScan::default()
    };
    let mut writer = context.writer()?;
    let mut progress = Progress::of_stages(&context.console, writer.session().stage_count());
    let (name, report) = writer.add_garment(&new, &mut |event| progress.show(event))?;
    let Built { verdicts, .. } = writer.build(&Forced::Nothing, &mut |event| progress.show(event))?;
    progress.end();
    let own: Vec<_> = verdicts.into_iter().filter(|verdict| verdict.step == name).collect();
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
