//! `overcoat tryon`: put a garment from a file onto the figure.

use super::console::{Context, Done, Progress, secs, verdicts};
use crate::scan::Unit;
use crate::session::{Built, Forced, NewScan};
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
}

pub(super) fn run(args: TryOnArgs, context: &Context) -> anyhow::Result<Done> {
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
