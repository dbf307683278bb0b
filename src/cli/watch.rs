//! `overcoat watch`: cuts a garment again and rebuilds its dependents whenever its mask file is saved.

use super::console::{Context, Done, Verbosity, measures_text, print_aside, print_line, secs, verdicts};
use super::failure;
use super::stages::interface;
use crate::check::StepVerdict;
use crate::session::{
    Built, Content, Forced, LiveView, Memory, Outputs, Recut, Session, SessionError, ShowIn, Writer, check_mask_name,
};
use serde_json::{Value, json};
use signal_hook::consts::{SIGINT, SIGTERM};
use std::collections::BTreeSet;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

#[derive(clap::Args)]
pub(super) struct WatchArgs {
    /// A garment; FILE becomes its mask
    #[arg(requires = "file")]
    layer: Option<String>,
    /// A mask file that is not yet a mask of the garment; it may not exist yet
    file: Option<PathBuf>,
    /// Show the cut garment, then everything that is rebuilt, in the Rerun viewer at URL; without a URL, in the one
    /// that runs on this machine or is started
    #[arg(long, value_name = "URL", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    view: Option<ShowIn>,
    /// With --view: the interface on which a viewer that is started listens [default: 127.0.0.1]
    #[arg(long, value_name = "ADDR", requires = "view", value_parser = interface)]
    bind: Option<IpAddr>,
    /// Draw the cut garment in the scan's pose after each change
    #[arg(long, value_name = "OUT.png")]
    picture: Option<PathBuf>,
    /// Draw the contact sheet after each rebuild
    #[arg(long, value_name = "OUT.png")]
    sheet: Option<PathBuf>,
    /// Write the recording for the Rerun viewer after each rebuild
    #[arg(long, value_name = "OUT.rrd")]
    save: Option<PathBuf>,
    /// Cut only; leave the rebuild of later stages to `build`
    #[arg(long)]
    cut_only: bool,
    /// Stop after N changes
    #[arg(long, value_name = "N")]
    changes: Option<usize>,
    /// Replace files that Overcoat did not write, or that were changed since
    #[arg(long)]
    force: bool,
}

/// Polling interval: short enough to go unnoticed, and checking a few files is cheap.
const POLL: Duration = Duration::from_millis(20);

/// A watched file.
struct Watched {
    layer: String,
    path: PathBuf,
    /// Its state when it was last applied; `None` if it did not exist.
    seen: Option<Look>,
    /// Its state at the last check: a file that still changes is being written.
    last: Option<Look>,
}

/// The properties by which a saved file differs from its previous state.
#[derive(Clone, PartialEq)]
struct Look {
    modified: SystemTime,
    len: u64,
}

impl Look {
    fn at(path: &Path) -> Option<Self> {
        let meta = std::fs::metadata(path).ok().filter(|m| m.is_file())?;
        Some(Self { modified: meta.modified().ok()?, len: meta.len() })
    }
}

impl Watched {
    fn new(layer: String, path: PathBuf) -> Self {
        let look = Look::at(&path);
        Self { layer, path, seen: look.clone(), last: look }
    }

    /// The canonical path of a file, even before it exists.
    fn place(path: &Path) -> Option<PathBuf> {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        path.canonicalize().ok().or_else(|| Some(folder.canonicalize().ok()?.join(path.file_name()?)))
    }

    /// The time of the last save, if it is new and the file no longer changes.
    fn saved(&mut self) -> Option<SystemTime> {
        let look = Look::at(&self.path);
        let rests = look == self.last;
        self.last.clone_from(&look);
        let new = look.filter(|look| rests && self.seen.as_ref() != Some(look))?;
        let modified = new.modified;
        self.seen = Some(new);
        Some(modified)
    }
}

pub(super) fn run(args: WatchArgs, context: &Context) -> anyhow::Result<Done> {
    let ended = ended_by_signal()?;
    let mut watch = Watch::begin(&args, context)?;
    while !ended.load(Ordering::Relaxed) && args.changes.is_none_or(|n| watch.taken < n) {
        watch.look();
        std::thread::sleep(POLL);
    }
    let json = json!({ "session": context.session.display().to_string(), "changes": watch.log });
    Ok(Done::new("watch", json).line(format!("watched {}", changes_of(watch.taken))))
}

fn changes_of(count: usize) -> String {
    match count {
        1 => "1 change".into(),
        n => format!("{n} changes"),
    }
}

/// Set by Ctrl-C or a termination signal.
pub(super) fn ended_by_signal() -> anyhow::Result<Arc<AtomicBool>> {
    let ended = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&ended))?;
    }
    Ok(ended)
}

struct Watch<'a> {
    args: &'a WatchArgs,
    context: &'a Context,
    files: Vec<Watched>,
    viewer: Option<LiveView>,
    outputs: Outputs,
    /// Caches loaded and prepared values between changes.
    memory: Memory,
    taken: usize,
    log: Vec<Value>,
}

impl<'a> Watch<'a> {
    fn begin(args: &'a WatchArgs, context: &'a Context) -> anyhow::Result<Self> {
        let session = Session::open(&context.session)?;
        let mut files: Vec<Watched> =
            session.mask_files().into_iter().map(|(layer, path)| Watched::new(layer, path)).collect();
        if let (Some(layer), Some(file)) = (&args.layer, &args.file) {
            session.masks(Some(layer))?;
            check_mask_name(file)?;
            let file = context.input(file.clone());
            let place = Watched::place(&file);
            let same = |w: &Watched| w.layer == *layer && Watched::place(&w.path) == place;
            if !files.iter().any(same) {
                // Its current content is applied at once.
                let layer = layer.clone();
                files.push(Watched { layer, last: Look::at(&file), seen: None, path: file });
            }
        }
        if files.is_empty() {
            return Err(SessionError::BadRequest {
                what: "there is no mask file to watch".into(),
                hint: "name a garment and a file: `overcoat watch LAYER FILE`".into(),
            }
            .into());
        }
        let mut outputs = session.outputs(args.force);
        files.iter().for_each(|watched| outputs.protect(&watched.path, "is a mask"));
        let asked =
            [(&args.picture, Content::Picture), (&args.sheet, Content::Picture), (&args.save, Content::Recording)];
        for (path, content) in asked {
            path.iter().try_for_each(|path| outputs.claim(path, content))?;
        }
        let memory = Memory::default();
        let mut watch = Self { args, context, files, viewer: None, outputs, memory, taken: 0, log: Vec::new() };
        watch.warm()?;
        if let Some(view) = &args.view {
            let shown = view.clone().with_bind(args.bind);
            watch.viewer = Some(LiveView::open(&Session::open(&context.session)?, &shown)?);
        }
        let paths: Vec<String> = watch.files.iter().map(|w| w.path.display().to_string()).collect();
        watch.say(&format!("watching {}; stop with Ctrl-C", paths.join(", ")));
        Ok(watch)
    }

    /// Builds the stages that are out of date before the first change, and loads everything that a recut needs.
    fn warm(&self) -> anyhow::Result<()> {
        let mut writer = Writer::open(&self.context.session)?;
        writer.remember(&self.memory);
        if let Some(built) = self.unless_failed(writer.build(&Forced::Nothing, &mut |_| {}))?
            && built.reports.iter().any(|r| r.ran)
        {
            self.say_verdicts(&built.verdicts);
        }
        for layer in self.files.iter().map(|w| &w.layer).collect::<BTreeSet<_>>() {
            self.unless_failed(writer.recut(layer, &mut |_| {}))?;
        }
        Ok(())
    }

    /// A garment that cannot be built is reported: another one may be watched, or the mask to come may correct it.
    fn unless_failed<T>(&self, done: Result<T, SessionError>) -> Result<Option<T>, SessionError> {
        match done {
            Err(e @ SessionError::Stage { .. }) => {
                self.say_error(&e.to_string());
                Ok(None)
            }
            done => done.map(Some),
        }
    }

    /// Applies the files saved since the last check.
    fn look(&mut self) {
        for i in 0..self.files.len() {
            let Some(saved) = self.files[i].saved() else { continue };
            let (layer, path) = (self.files[i].layer.clone(), self.files[i].path.clone());
            let taken = self.take_up(&layer, &path, saved);
            if taken.as_ref().is_err_and(|e| matches!(e.downcast_ref(), Some(SessionError::Locked { .. }))) {
                // Another command is changing the session; try this file again later.
                self.files[i].seen = None;
                continue;
            }
            self.taken += 1;
            // An invalid file is reported and the session stays unchanged; the next save may correct it.
            if let Err(e) = taken {
                self.log.push(json!({ "layer": layer, "file": path.display().to_string(), "error": e.to_string() }));
                self.say_error(&e.to_string());
            }
        }
    }

    fn take_up(&mut self, layer: &str, path: &Path, saved: SystemTime) -> anyhow::Result<()> {
        let mut writer = Writer::open(&self.context.session)?;
        writer.remember(&self.memory);
        let recut = writer.recut_with(layer, path, &mut |_| {})?;
        let shown = self.viewer.as_mut().map(|viewer| viewer.show_cut(layer, &recut.garment));
        let waited = saved.elapsed().unwrap_or_default();
        self.unless_closed(shown);
        if let Some(picture) = &self.args.picture {
            writer.session().draw_garment(&recut.garment, layer, picture, &mut self.outputs)?;
        }
        self.say(&summary(layer, path, waited, &recut));
        let began = Instant::now();
        // Without a rebuild there is nothing to judge.
        let (rebuilt, verdicts) = match self.args.cut_only {
            true => (0, Vec::new()),
            false => {
                let Built { reports, verdicts } = writer.build(&Forced::Nothing, &mut |_| {})?;
                let changed = verdicts.into_iter().skip_while(|v| v.step != layer).collect();
                (reports.iter().filter(|r| r.ran).count(), changed)
            }
        };
        drop(writer);
        if rebuilt > 0 {
            self.say(&format!("  rebuilt {rebuilt} stages that depend on it in {}", secs(began.elapsed())));
        }
        self.say_verdicts(&verdicts);
        self.show(rebuilt)?;
        let seen = self.viewer.is_some();
        self.log.push(json!({
            "layer": layer,
            "file": path.display().to_string(),
            "saved_to_recut_secs": waited.as_secs_f64(),
            "in_viewer": seen,
            "vertices": recut.garment.mesh.vertex_count(),
            "hem_loops": recut.garment.hem_loops.len(),
            "rebuilt_stages": rebuilt,
            "steps": verdicts,
            "rebuild_secs": began.elapsed().as_secs_f64(),
        }));
        Ok(())
    }

    /// Writes and shows the requested outputs after the rebuild.
    fn show(&mut self, rebuilt: usize) -> anyhow::Result<()> {
        let in_viewer = self.viewer.is_some() && rebuilt > 0;
        if self.args.sheet.is_none() && self.args.save.is_none() && !in_viewer {
            return Ok(());
        }
        let session = Session::open(&self.context.session)?;
        if in_viewer {
            let shown = self.viewer.as_mut().map(|viewer| viewer.show_all(&session));
            self.unless_closed(shown);
        }
        if let Some(path) = &self.args.sheet {
            session.write_sheet(path, &mut self.outputs)?;
            self.say(&format!("  drew {}", path.display()));
        }
        if let Some(path) = &self.args.save {
            session.write_recording(path, &mut self.outputs)?;
            self.say(&format!("  recorded {}", path.display()));
        }
        Ok(())
    }

    /// Watching continues after the viewer was closed.
    fn unless_closed(&mut self, shown: Option<Result<(), SessionError>>) {
        if let Some(Err(e)) = shown {
            self.viewer = None;
            self.say_error(&format!("{e}; the viewer is no longer updated"));
        }
    }

    /// Says the verdict on each step, as `build` does.
    fn say_verdicts(&self, verdicts: &[StepVerdict]) {
        verdicts.iter().for_each(|step| self.say(&format!("  {}", verdicts::line(step))));
    }

    fn say_error(&self, text: &str) {
        if self.context.console.verbosity > Verbosity::Quiet {
            print_aside(&format!("error: {}", failure::one_line(text)));
        }
    }

    fn say(&self, line: &str) {
        if self.context.console.verbosity == Verbosity::Quiet {
            return;
        }
        // With --json, stdout receives only the final object.
        if self.context.console.is_json() { print_aside(line) } else { print_line(line) }
    }
}

fn summary(layer: &str, path: &Path, waited: Duration, recut: &Recut) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let measures: Vec<String> = recut
        .reports
        .iter()
        .filter(|r| r.ran && r.step == layer)
        .map(measures_text)
        .filter(|t| !t.is_empty())
        .collect();
    let findings = recut.garment.findings.iter().map(|f| format!("\n  {f}")).collect::<String>();
    format!(
        "{name} saved; {layer} cut again {:.0} ms later: {}{findings}",
        1e3 * waited.as_secs_f64(),
        if measures.is_empty() { "no difference".into() } else { measures.join(", ") }
    )
}
