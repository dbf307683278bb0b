//! `overcoat demo`: builds a character from the scans that come with the program.

use super::console::{Context, Done, Progress, Verbosity, print_aside, secs, verdicts};
use super::measure::lines_of;
use crate::segment::GarmentTemplate;
use crate::session::{
    BODY_STEP, Built, Event, ExportRequest, Forced, MaskReport, NewFolder, NewScan, NewSession, Session, SessionError,
    SubjectOrigin, TruthReport, Writer, create,
};
use anyhow::Context as _;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct DemoArgs {
    /// Work in this folder, new or empty, instead of a temporary one
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,
}

/// One of the shipped scans: `1-skirt.ply` is the step `skirt`, of the kind `skirt`; `0-body` is a folder of frames.
struct ShippedScan {
    name: String,
    template: Option<String>,
    file: PathBuf,
}

pub(super) fn run(args: DemoArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let scans_dir = scans_dir()?;
    let scans = shipped_scans(&scans_dir)?;
    let dir = match args.keep {
        Some(dir) => dir,
        None => {
            let made = tempfile::Builder::new().prefix("overcoat-demo-").tempdir();
            made.context("no temporary folder can be made; name one with --keep DIR")?.keep()
        }
    };
    let session_dir = dir.join("session");
    let say = |line: String| {
        if context.console.verbosity > Verbosity::Quiet {
            print_aside(&line);
        }
    };
    NewFolder::create(&dir)?;
    say(format!("demo in {}", dir.display()));
    create(&session_dir, &NewSession::default())?;

    let mut progress = Progress::of_stages(&context.console, scans.len());
    let mut writer = Writer::open(&session_dir)?;
    for scan in &scans {
        let (name, template, file) = (scan.name.clone(), scan.template.clone(), scan.file.clone());
        writer.add_scan(&NewScan { name, template, file, ..NewScan::default() }, &mut |event| progress.show(event))?;
    }
    progress.end();
    let mut progress = Progress::of_stages(&context.console, writer.session().stage_count());
    // The verdicts are shown once, at the end.
    let mut show = |event: &Event| match event {
        Event::StepDone(_) => {}
        event => progress.show(event),
    };
    let corrections = corrected(&mut writer, &scans)?;
    let Built { reports: stages, verdicts: of_steps } = writer.build(&Forced::Nothing, &mut show)?;
    progress.end();
    drop(writer);

    let session = Session::open(&session_dir)?;
    let mut outputs = session.outputs(false);
    let mut files = vec![session_dir.clone()];
    let request = |target| ExportRequest { target, ..ExportRequest::default() };
    let glb = dir.join("character.glb");
    files.extend(session.export(&request(glb), &mut outputs, &mut |_| {})?.files);
    let layers = dir.join("layers");
    session.export(&request(layers.clone()), &mut outputs, &mut |_| {})?;
    files.push(layers);
    if cfg!(feature = "rerun") {
        let recording = dir.join("session.rrd");
        session.write_recording(&recording, &mut outputs)?;
        files.push(recording);
    }
    let sheet = dir.join("sheet.png");
    session.write_sheet(&sheet, &mut outputs)?;
    files.push(sheet);
    let poster = dir.join("poster.png");
    session.write_poster(&poster, &mut outputs)?;
    files.push(poster);
    let truth = measured(&session, &scans_dir.join("truth"))?;

    context.console.notices(outputs.notices());
    let (count, bytes) = size_of(&dir)?;
    let folder = dir.display().to_string();
    let remove = format!("rm -r {}", shlex::try_quote(&folder).unwrap_or(folder.as_str().into()));
    let shown: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
    let json = json!({
        "session": session_dir.display().to_string(),
        "steps": scans.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(),
        "stages": stages,
        "corrections": corrections.iter().map(|c| json!({ "layer": c.layer, "strokes": c.file })).collect::<Vec<_>>(),
        "truth": truth,
        "files": shown,
        "folder": folder,
        "file_count": count,
        "bytes": bytes,
        "remove": remove,
        "secs": began.elapsed().as_secs_f64(),
    });
    let mut done = Done::new("demo", json);
    if let Some(report) = &truth {
        done = done.lines(figures(report));
        if context.console.verbosity > Verbosity::Normal {
            done = done.line("all measures, as docs/evaluation.md explains them:").lines(lines_of(report));
        }
    }
    Ok(done
        .lines(corrections.iter().map(Correction::line))
        .lines(of_steps.iter().map(verdicts::line))
        .line(format!("dressed a body in {} garments in {}:", scans.len() - 1, secs(began.elapsed())))
        .lines(shown.iter().map(|f| format!("  {f}")))
        .line(format!("{count} files, {:.0} MB, are in {folder}; remove them with: {remove}", bytes as f64 / 1e6))
        .next(format!("overcoat -C {} status", session_dir.display()))
        .next("overcoat new DIR, with scans of your own"))
}

/// The result beside the known truth, in three figures.
fn figures(report: &TruthReport) -> Vec<String> {
    let garments = || report.steps.iter().filter_map(|step| Some((&step.name, step.garment.as_ref()?)));
    let body = report.steps.iter().find_map(|step| step.surface).map(|body| {
        format!("the body is {:.1} mm from the true one, on average over its surface", body.surface_mean_mm)
    });
    let farthest = garments().max_by(|a, b| a.1.garment_surface_mean_mm.total_cmp(&b.1.garment_surface_mean_mm));
    let farthest = farthest.map(|(name, garment)| {
        format!(
            "each garment is up to {:.1} mm ({name}) from the true one, on average",
            garment.garment_surface_mean_mm
        )
    });
    let worst = garments().min_by(|a, b| a.1.garment_iou.total_cmp(&b.1.garment_iou));
    let worst = worst.map(|(name, garment)| {
        format!("of each garment, at least {:.0} % ({name}) was recognised in its scan", 100.0 * garment.garment_iou)
    });
    [body, farthest, worst].into_iter().flatten().collect()
}

/// The effect of a shipped brush file.
struct Correction {
    layer: String,
    file: String,
    report: MaskReport,
}

impl Correction {
    fn line(&self) -> String {
        let MaskReport { added, erased, .. } = self.report;
        format!("corrected {} with {}: {added} vertices of the scan added, {erased} removed", self.layer, self.file)
    }
}

/// Applies the brush file of each garment that has one, `1-tshirt.jsonl` beside `1-tshirt.ply`.
fn corrected(writer: &mut Writer, scans: &[ShippedScan]) -> Result<Vec<Correction>, SessionError> {
    let mut done = Vec::new();
    for scan in scans {
        let strokes = scan.file.with_extension("jsonl");
        if strokes.is_file() {
            let report = writer.add_mask(&scan.name, &strokes, &[])?;
            let file = strokes.file_name().map(|f| f.to_string_lossy().into_owned()).unwrap_or_default();
            done.push(Correction { layer: scan.name.clone(), file, report });
        }
    }
    Ok(done)
}

/// The number of files below a folder, and their bytes.
fn size_of(dir: &Path) -> anyhow::Result<(usize, u64)> {
    let (mut count, mut bytes) = (0, 0);
    let mut folders = vec![dir.to_path_buf()];
    while let Some(folder) = folders.pop() {
        let entries = std::fs::read_dir(&folder).with_context(|| format!("'{}' cannot be read", folder.display()))?;
        for entry in entries {
            let entry = entry?;
            let found = entry.metadata()?;
            match found.is_dir() {
                true => folders.push(entry.path()),
                false => (count, bytes) = (count + 1, bytes + found.len()),
            }
        }
    }
    Ok((count, bytes))
}

fn measured(session: &Session, truth: &Path) -> Result<Option<TruthReport>, SessionError> {
    if truth.is_dir() { session.measure(truth, SubjectOrigin::Invented).map(Some) } else { Ok(None) }
}

/// `scans/demo`, from the current folder or from where the program was built.
fn scans_dir() -> Result<PathBuf, SessionError> {
    let roots = [PathBuf::from("."), PathBuf::from(env!("CARGO_MANIFEST_DIR"))];
    let mut places = roots.iter().map(|root| root.join("scans").join("demo"));
    places.find(|place| place.is_dir()).ok_or_else(|| SessionError::BadRequest {
        what: "the scans of the demo are not here".into(),
        hint: "run `overcoat demo` in the folder of the source code, which has them in scans/demo".into(),
    })
}

fn shipped_scans(dir: &Path) -> anyhow::Result<Vec<ShippedScan>> {
    let entries = std::fs::read_dir(dir).with_context(|| format!("'{}' cannot be read", dir.display()))?;
    let mut files: Vec<PathBuf> = entries.map(|e| Ok(e?.path())).collect::<std::io::Result<_>>()?;
    // If a scan also exists as frames, the demo starts from the frames.
    files.retain(|f| match f.extension() {
        Some(extension) => extension == "ply" && !f.with_extension("").join("camera.json").is_file(),
        None => f.join("camera.json").is_file(),
    });
    files.sort();
    let scans: Vec<ShippedScan> =
        files.into_iter().filter_map(|file| shipped_scan(file).transpose()).collect::<anyhow::Result<_>>()?;
    if scans.first().is_none_or(|s| s.name != BODY_STEP) {
        let what = format!("'{}' has no scan of the bare body, neither 0-body.ply nor 0-body", dir.display());
        return Err(SessionError::BadRequest { what, hint: "get the source code again".into() }.into());
    }
    Ok(scans)
}

/// A scan by its file's name; `None` for a file that is not named like one. A garment without a template is an error: the
/// demo would silently leave a layer out.
fn shipped_scan(file: PathBuf) -> anyhow::Result<Option<ShippedScan>> {
    let stem = file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let Some((number, name)) = stem.split_once('-') else { return Ok(None) };
    if number.parse::<u32>().is_err() {
        return Ok(None);
    }
    let template = match name {
        BODY_STEP => None,
        _ => {
            let found = GarmentTemplate::built_in(name);
            Some(found.with_context(|| format!("the scan '{}' of the demo has no template", file.display()))?.name)
        }
    };
    Ok(Some(ShippedScan { name: name.to_string(), template, file }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scan_of_an_unknown_garment_is_an_error_and_other_files_are_not_scans() {
        let scan = |name: &str| shipped_scan(PathBuf::from(name));
        let skirt = scan("1-skirt.ply").unwrap().unwrap();
        assert_eq!((skirt.name.as_str(), skirt.template.as_deref()), ("skirt", Some("skirt")));
        assert_eq!(scan("0-body").unwrap().unwrap().template, None);
        assert!(scan("turntable.ply").unwrap().is_none() && scan("depth-noise.ply").unwrap().is_none());
        let Err(error) = scan("3-cape.ply") else { panic!("a cape was taken") };
        assert!(format!("{error:#}").contains("3-cape.ply"), "{error:#}");
    }
}
