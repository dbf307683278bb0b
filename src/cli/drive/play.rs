//! Plays a stream on the figure: reader, solver, and all that a frame goes to.

use super::args::{BetweenWord, MethodWord, PlayArgs};
use super::choose::{Chosen, nearest_in_size};
use super::error::DriveFailure;
use super::save::Save;
use super::vmc;
use crate::body::Figure;
use crate::cli::console::{Context, Done, Progress, secs};
use crate::cloth::LiveCloth;
use crate::drive::{
    Between, DriveError, KeyPoses, LandmarkFrame, PlayedFrame, Player, PoseLibrary, Smoothing, StreamError,
    StreamFormat, StreamKind, StreamOptions, StreamReader, WornGarments, embedded_library,
};
use crate::session::{Content, DriveView, Outputs, SessionError, ShowIn};
use serde_json::json;
use signal_hook::consts::{SIGINT, SIGTERM};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::time::{Duration, Instant};

/// The pose library of the paper's method; `None` for inverse kinematics.
fn library_of(args: &PlayArgs) -> anyhow::Result<Option<PoseLibrary>> {
    match (args.method, &args.library) {
        (MethodWord::Ik, None) if args.key_interval > 0.0 => Err(SessionError::BadRequest {
            what: "inverse kinematics follows every frame and has no key poses".into(),
            hint: "add --method laplacian, or leave --key-interval out".into(),
        }
        .into()),
        (MethodWord::Ik, None) => Ok(None),
        (MethodWord::Ik, Some(_)) => Err(SessionError::BadRequest {
            what: "a pose library is of no use to inverse kinematics".into(),
            hint: "add --method laplacian, or leave --library out".into(),
        }
        .into()),
        (MethodWord::Laplacian, None) => Ok(Some(embedded_library().map_err(DriveFailure::from)?)),
        (MethodWord::Laplacian, Some(path)) => {
            let bytes = std::fs::read(path).map_err(|e| SessionError::reading(path, e))?;
            Ok(Some(PoseLibrary::read(&bytes).map_err(DriveError::from).map_err(DriveFailure::from)?))
        }
    }
}

/// Cloth that follows the poses, if it is asked for.
fn cloth_of<'a>(args: &PlayArgs, figure: &'a Figure) -> anyhow::Result<Option<LiveCloth<'a>>> {
    let refused = |what: &str, hint: &str| SessionError::BadRequest { what: what.into(), hint: hint.into() };
    match args.cloth {
        false => Ok(None),
        true if args.method == MethodWord::Laplacian => {
            let hint = "use --method ik, or leave --cloth out";
            Err(refused("cloth follows a pose, and the paper's method moves the surface itself", hint).into())
        }
        true if figure.garments().is_empty() => {
            Err(refused("the figure wears no garment that could swing", "leave --cloth out").into())
        }
        true => Ok(Some(LiveCloth::prepare(figure).map_err(DriveFailure::from)?)),
    }
}

/// What the thread that reads the stream sends.
enum Arrived {
    Frame { frame: Box<LandmarkFrame>, kind: StreamKind, format: Option<StreamFormat>, read: Instant },
    Problem(StreamError),
    End(Vec<String>),
}

/// Frames that wait between reader and solver: the solver is far faster than any tracker, so they hardly ever do.
const WAITING: usize = 256;
/// How often the signal to stop is looked for.
const POLL: Duration = Duration::from_millis(50);

pub(super) fn play(args: PlayArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let stream = args.stream.clone().unwrap_or_default();
    let library = library_of(&args)?;
    let options = StreamOptions { kind: None, unit: args.unit, up: args.up };
    let session = context.reader()?;
    let Chosen { session, figure, note } = match args.among.is_empty() {
        true => Chosen { figure: session.figure_of_last_step()?, session, note: None },
        false => nearest_in_size(&stream, options, (&context.session, session), &args.among)?,
    };
    let mut outputs = session.outputs(args.force);
    if let Some(film) = &args.film {
        outputs.claim(film, Content::Film)?;
    }
    if let Some(path) = &args.save {
        outputs.claim(path, Content::Poses)?;
    }
    let to = match (&args.view, args.save.is_some() || args.film.is_some()) {
        (Some(to), _) => Some(to.clone()),
        (None, true) => None,
        (None, false) => Some("".parse().unwrap_or(ShowIn::File(PathBuf::new()))),
    };
    let is_live_view = to.as_ref().is_some_and(|to| !matches!(to, ShowIn::File(_)));
    let view = match &to {
        Some(to) => Some(DriveView::begin(&session, to, args.force)?),
        None => None,
    };
    let cloth = cloth_of(&args, &figure)?;
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&stop))?;
    }
    if let Some(port) = args.vmc {
        let to = vmc::Receiver { figure: &figure, cloth, save: args.save.as_deref(), view, outputs };
        return vmc::receive(port, to, &stop, context);
    }
    let input = open(&stream, &mut outputs)?;
    let is_piped = stream.as_os_str() == "-";
    let arrived = read_in_background(input, options, args.height);
    let smoothing = args.raw.then_some(Smoothing { min_cutoff_hz: 0.0, beta: 0.0, bridge_secs: 0.0 });
    let player = Player::new(&figure, StreamKind { stature: args.height, ..StreamKind::default() }, smoothing);
    let mut stage = Stage {
        figure: &figure,
        player: match library {
            Some(library) => {
                let between = match args.between {
                    BetweenWord::Rotations => Between::Rotations,
                    BetweenWord::Linear => Between::Linear,
                };
                player.by_laplacian(library, KeyPoses { interval_secs: args.key_interval, between })
            }
            None => player,
        },
        worn: WornGarments::prepare(&figure),
        cloth,
        save: args.save.as_deref().map(|path| (path, None)),
        outputs,
        view,
        film: args.film.is_some().then(Vec::new),
        is_piped,
        is_live_view,
        pace: is_live_view && !is_piped,
        started: None,
        latencies: Vec::new(),
        shown: 0,
        dropped: 0,
        number: 0,
        crossings: Vec::new(),
    };
    let mut progress = Progress::of_one_stage(&context.console);
    let outcome = stage.play(&arrived, &stop, &mut |text| progress.describe(text));
    progress.end();
    let Stage { player, save, mut outputs, view, film, mut latencies, shown, dropped, number, crossings, .. } = stage;
    if let Some((_, Some(save))) = save {
        save.end(&mut outputs)?;
    }
    if let Some(view) = view {
        view.finish()?;
    }
    let Outcome { notes, problems, format, fatal } = outcome;
    if number == 0 {
        return Err(fatal.unwrap_or_else(|| DriveFailure::Nothing.into()));
    }
    if let (Some(path), Some(frames)) = (&args.film, &film) {
        session.write_driven_film(path, &mut outputs, &figure, frames, cloth_of(&args, &figure)?)?;
    }
    context.console.notices(outputs.notices());
    let counts = player.counts();
    latencies.sort_by(f64::total_cmp);
    let latency = |share: f64| latencies.get((share * (latencies.len().max(1) - 1) as f64) as usize).copied();
    let steps = counts.steps as f64 / counts.frames.max(1) as f64;
    let distance_mm = counts.distance / counts.frames.max(1) as f64 * 1e3;
    let calibration_notes: Vec<String> =
        note.into_iter().chain(player.calibration().map(|c| c.notes.clone()).unwrap_or_default()).collect();
    let json = json!({
        "session": session.dir().display().to_string(),
        "format": format.map(StreamFormat::name),
        "frames": counts.frames,
        "calibrated_at_secs": player.calibration().map(|c| c.at_secs),
        "relative_size": player.calibration().map(|c| c.scale),
        "incomplete_frames": counts.incomplete,
        "unreached_frames": counts.unreached,
        "distance_mm": distance_mm,
        "noise_mm": player.noise() * 1e3,
        "steps_per_frame": steps,
        "crossing_pairs": crossings,
        "shown": shown,
        "dropped": dropped,
        "latency_ms": { "median": latency(0.5), "p95": latency(0.95), "max": latency(1.0) },
        "saved": args.save.as_ref().map(|p| p.display().to_string()),
        "film": args.film.as_ref().map(|p| p.display().to_string()),
        "notes": notes, "problems": problems, "calibration": calibration_notes,
        "secs": began.elapsed().as_secs_f64(),
    });
    let mut done = Done::new("drive", json).line(format!(
        "drove {} frames ({}) in {}: the figure follows its landmarks to {distance_mm:.0} mm on average",
        counts.frames,
        format.map_or("unknown format", StreamFormat::name),
        secs(began.elapsed())
    ));
    if let (Some(median), Some(p95)) = (latency(0.5), latency(0.95)) {
        done = done.line(format!(
            "latency from line to frame: {median:.1} ms, 95 % within {p95:.1} ms; {steps:.1} steps per frame"
        ));
    }
    if to.is_some() {
        done = done.line(format!("{shown} frames shown, {dropped} dropped"));
    }
    if let Some(most) = crossings.iter().max() {
        let some = crossings.iter().filter(|pairs| **pairs > 0).count();
        done = done.line(format!(
            "garments cross in {some} of {} frames looked at, by at most {most} pairs of triangles",
            crossings.len()
        ));
    }
    for (count, what) in [
        (counts.incomplete, "frames lack a landmark for longer than could be bridged"),
        (counts.unreached, "frames have landmarks that the figure cannot reach"),
    ] {
        if count > 0 {
            done = done.line(format!("{count} {what}"));
        }
    }
    done = done.lines(calibration_notes.into_iter().chain(notes).chain(problems).map(|note| format!("  {note}")));
    if let Some(path) = &args.save {
        done = done.line(format!("saved {}", path.display()));
        done = done.next(context.overcoat(&format!("animate {}", path.display())));
    }
    if let Some(path) = &args.film {
        done = done.line(format!("drew {}", path.display()));
    }
    Ok(match fatal {
        Some(error) => {
            let hint_of = || error.downcast_ref().and_then(DriveFailure::hint);
            let hint = error.downcast_ref().and_then(SessionError::hint).or_else(hint_of).unwrap_or_default();
            done.failed(format!("the stream ends early: {error}; what came before is kept"), hint)
        }
        None => done,
    })
}

fn open(stream: &Path, outputs: &mut Outputs) -> Result<Box<dyn BufRead + Send>, SessionError> {
    if stream.as_os_str() == "-" {
        return Ok(Box::new(BufReader::new(std::io::stdin())));
    }
    outputs.protect(stream, "is the stream of landmarks");
    let failed = |e| SessionError::reading(stream, e);
    if std::fs::metadata(stream).map_err(failed)?.is_dir() {
        return Err(SessionError::BadRequest {
            what: format!("{} is a folder", stream.display()),
            hint: "name a file with a stream of landmarks, or - for standard input".into(),
        });
    }
    Ok(Box::new(BufReader::new(std::fs::File::open(stream).map_err(failed)?)))
}

fn read_in_background(
    input: Box<dyn BufRead + Send>,
    options: StreamOptions,
    stature: Option<f64>,
) -> Receiver<Arrived> {
    let (sender, receiver) = sync_channel(WAITING);
    std::thread::spawn(move || read(StreamReader::new(input, options), stature, &sender));
    receiver
}

fn read(mut reader: StreamReader<Box<dyn BufRead + Send>>, stature: Option<f64>, to: &SyncSender<Arrived>) {
    while let Some(next) = reader.next_frame() {
        let read = Instant::now();
        let kind = StreamKind {
            is_hip_centred: reader.is_hip_centred(),
            are_joint_centres: reader.are_joint_centres(),
            stature,
        };
        let format = reader.kind();
        let message = match next {
            Ok(frame) => Arrived::Frame { frame: Box::new(frame), kind, format, read },
            Err(problem) => Arrived::Problem(problem),
        };
        if to.send(message).is_err() {
            return;
        }
    }
    let _ = to.send(Arrived::End(reader.notes()));
}

/// How a stream ended.
struct Outcome {
    notes: Vec<String>,
    /// Lines that could not be used, one sentence each.
    problems: Vec<String>,
    format: Option<StreamFormat>,
    /// Why the stream could not go on.
    fatal: Option<anyhow::Error>,
}

/// Everything that a frame goes to.
struct Stage<'a> {
    figure: &'a Figure,
    player: Player<'a>,
    /// The garments, for the paper's method.
    worn: WornGarments<'a>,
    cloth: Option<LiveCloth<'a>>,
    /// Where the poses are written, once there are some.
    save: Option<(&'a Path, Option<Save>)>,
    outputs: Outputs,
    view: Option<DriveView>,
    film: Option<Vec<PlayedFrame>>,
    /// Whether frames come as they are captured.
    is_piped: bool,
    /// Whether a viewer shows frames now; a recording to a file keeps all of them.
    is_live_view: bool,
    /// Whether a recorded stream is shown at the speed at which it was recorded.
    pace: bool,
    /// When the first frame was shown, and its time in the stream.
    started: Option<(Instant, f64)>,
    latencies: Vec<f64>,
    shown: usize,
    dropped: usize,
    number: usize,
    /// Pairs of triangles that cross, of the frames looked at.
    crossings: Vec<usize>,
}

impl Stage<'_> {
    fn play(&mut self, arrived: &Receiver<Arrived>, stop: &AtomicBool, describe: &mut dyn FnMut(String)) -> Outcome {
        /// Lines that are reported one by one.
        const REPORTED: usize = 3;
        let mut outcome = Outcome { notes: Vec::new(), problems: Vec::new(), format: None, fatal: None };
        let mut bad_lines = 0;
        loop {
            if stop.load(Ordering::Relaxed) {
                outcome.notes.push("stopped by a signal".into());
                break;
            }
            let message = match arrived.recv_timeout(POLL) {
                Ok(message) => message,
                Err(RecvTimeoutError::Timeout) => continue,
                Err(RecvTimeoutError::Disconnected) => break,
            };
            match message {
                Arrived::Frame { frame, kind, format, read } => {
                    outcome.format = outcome.format.or(format);
                    self.player.set_kind(kind);
                    if let Err(error) = self.take(*frame, read, describe) {
                        outcome.fatal = Some(error);
                        break;
                    }
                }
                Arrived::Problem(problem) if problem.is_of_one_line() => {
                    bad_lines += 1;
                    if bad_lines <= REPORTED {
                        outcome.problems.push(format!("skipped: {problem}"));
                    }
                }
                Arrived::Problem(problem) => {
                    outcome.fatal = Some(DriveFailure::from(problem).into());
                    break;
                }
                Arrived::End(notes) => {
                    outcome.notes.extend(notes);
                    if let Err(error) = self.end(describe) {
                        outcome.fatal = Some(error);
                    }
                    break;
                }
            }
        }
        if bad_lines > REPORTED {
            outcome.problems.push(format!("skipped: {} more lines", bad_lines - REPORTED));
        }
        outcome
    }

    fn take(&mut self, frame: LandmarkFrame, read: Instant, describe: &mut dyn FnMut(String)) -> anyhow::Result<()> {
        let taken = Instant::now();
        let waited = self.player.calibration().is_none();
        let played = self.player.push(frame).map_err(DriveFailure::from)?;
        if self.player.calibration().is_none() {
            describe("waiting for 2 seconds in a T- or A-pose".into());
        }
        self.hand_out(played, waited, if self.is_piped { read } else { taken }, describe)
    }

    fn end(&mut self, describe: &mut dyn FnMut(String)) -> anyhow::Result<()> {
        let last = self.player.end().map_err(DriveFailure::from)?;
        self.hand_out(last, false, Instant::now(), describe)
    }

    /// Saves, shows and keeps frames. `read`: when the line of the last one was read; a file is read ahead, so there it is when
    /// the frame was taken.
    fn hand_out(
        &mut self,
        played: Vec<PlayedFrame>,
        waited: bool,
        read: Instant,
        describe: &mut dyn FnMut(String),
    ) -> anyhow::Result<()> {
        for frame in played {
            if let Some((path, save)) = &mut self.save {
                let save = match save {
                    Some(save) => save,
                    None => save.insert(Save::begin(path, &mut self.outputs, self.figure)?),
                };
                save.frame(frame.secs, &frame.pose)?;
            }
            // Frames from before the calibration are late by definition.
            if !self.is_late(&frame, waited, read) {
                if let Some(view) = &mut self.view {
                    let meshes = match (&frame.solved, &mut self.cloth) {
                        (Some(solved), _) => self.worn.on(solved),
                        (None, Some(cloth)) => cloth.to_pose(&frame.pose, frame.secs),
                        (None, None) => self.figure.posed(&frame.pose),
                    };
                    view.show(self.number, &frame, self.figure, &meshes);
                }
                self.shown += 1;
                if !waited && !self.pace {
                    self.latencies.push(read.elapsed().as_secs_f64() * 1e3);
                }
            } else {
                self.dropped += 1;
            }
            if let Some(solved) = frame.solved.as_ref().filter(|_| self.counts_crossings(waited)) {
                self.crossings.extend(self.worn.crossing_pairs(solved));
            }
            if let Some(film) = &mut self.film {
                film.push(frame);
            }
            self.number += 1;
            describe(format!("frame {}", self.number));
        }
        Ok(())
    }

    /// Looked at once a second, and not while somebody waits for the frame: it takes longer than a frame.
    fn counts_crossings(&self, waited: bool) -> bool {
        const EVERY: usize = 30;
        !waited && !self.is_piped && !self.pace && self.figure.layers.len() > 1 && self.number.is_multiple_of(EVERY)
    }

    /// Whether a frame comes too late to be shown; waits where it comes too early. `read`: when its line was read.
    fn is_late(&mut self, frame: &PlayedFrame, waited: bool, read: Instant) -> bool {
        /// A frame this late is dropped, in seconds: one frame at 30 per second.
        const LATE: f64 = 1.0 / 30.0;
        if !self.is_live_view {
            return false;
        }
        if !self.pace {
            // Of what waited for the calibration, one frame is shown.
            return if waited { self.number > 0 } else { read.elapsed().as_secs_f64() > LATE };
        }
        let (began, first) = *self.started.get_or_insert((Instant::now(), frame.secs));
        let due = frame.secs - first - began.elapsed().as_secs_f64();
        if due > 0.0 {
            std::thread::sleep(Duration::from_secs_f64(due.min(1.0)));
        }
        due < -LATE
    }
}
