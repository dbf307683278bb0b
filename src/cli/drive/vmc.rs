//! Bones of a live tracker that sends VMC: they are retargeted to the figure as they arrive.

use super::error::DriveFailure;
use super::save::Save;
use crate::body::Figure;
use crate::cli::console::{Context, Done, Progress, secs};
use crate::cloth::LiveCloth;
use crate::drive::{LANDMARKS, PlayedFrame, VmcDecoder, VmcFrame, VmcRig};
use crate::motion::LiveRetargeter;
use crate::session::{DriveView, Outputs, SessionError};
use serde_json::json;
use std::net::{Ipv4Addr, UdpSocket};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The largest UDP packet.
const LARGEST: usize = 65_536;
/// How often the signal to stop is looked for.
const POLL: Duration = Duration::from_millis(50);
/// A tracker that was heard and then is silent for so long has ended.
const SILENCE: Duration = Duration::from_secs(5);
/// Packets that are reported one by one.
const REPORTED: usize = 3;

/// What is done with the frames of a tracker.
pub(super) struct Receiver<'a> {
    pub figure: &'a Figure,
    pub cloth: Option<LiveCloth<'a>>,
    pub save: Option<&'a Path>,
    pub view: Option<DriveView>,
    pub outputs: Outputs,
}

/// Receives from a port of this machine until the tracker ends or the program is stopped.
pub(super) fn receive(port: u16, to: Receiver<'_>, stop: &AtomicBool, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let Receiver { figure, mut cloth, save: path, mut view, mut outputs } = to;
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, port)).map_err(|e| SessionError::BadRequest {
        what: format!("port {port} of this machine cannot be used: {e}"),
        hint: "end the program that listens there, or give another port, here and in the tracker".into(),
    })?;
    socket.set_read_timeout(Some(POLL))?;
    let mut progress = Progress::of_one_stage(&context.console);
    progress.describe(format!("waiting for a tracker on port {port}"));
    let (mut decoder, mut buffer) = (VmcDecoder::new(), vec![0; LARGEST]);
    let mut rig: Option<(VmcRig, LiveRetargeter<'_>)> = None;
    let (mut save, mut problems, mut bad) = (None, Vec::new(), 0);
    let (mut frames, mut heard, mut latencies) = (0_usize, None::<Instant>, Vec::new());
    let mut missing = Vec::new();
    while !stop.load(Ordering::Relaxed) && heard.is_none_or(|at| at.elapsed() < SILENCE) {
        let Ok(length) = socket.recv(&mut buffer) else { continue };
        let received = Instant::now();
        let complete: Vec<VmcFrame> = match decoder.push(&buffer[..length]) {
            Ok(complete) => complete,
            Err(problem) => {
                bad += 1;
                if bad <= REPORTED {
                    problems.push(format!("skipped: {problem}"));
                }
                continue;
            }
        };
        heard = Some(received);
        for frame in complete {
            if rig.is_none() {
                match VmcRig::of(&frame) {
                    Some(found) => {
                        let live =
                            LiveRetargeter::try_new(&figure.skeleton, found.motion()).map_err(DriveFailure::from)?;
                        rig = Some((found, live));
                    }
                    None => missing = VmcRig::missing(&frame),
                }
            }
            let Some((found, live)) = &mut rig else { continue };
            let pose = live.pose(found.next(&frame));
            let at_secs = received.duration_since(began).as_secs_f64();
            if let Some(path) = path {
                let save = match &mut save {
                    Some(save) => save,
                    None => save.insert(Save::begin(path, &mut outputs, figure)?),
                };
                save.frame(at_secs, &pose)?;
            }
            if let Some(view) = &mut view {
                let meshes = match &mut cloth {
                    Some(cloth) => cloth.to_pose(&pose, at_secs),
                    None => figure.posed(&pose),
                };
                let places = [None; LANDMARKS];
                let shown = PlayedFrame { secs: at_secs, places, pose, solved: None, steps: 0, distance: 0.0 };
                view.show(frames, &shown, figure, &meshes);
            }
            frames += 1;
            latencies.push(received.elapsed().as_secs_f64() * 1e3);
            progress.describe(format!("frame {frames}"));
        }
    }
    progress.end();
    if let Some(save) = save {
        save.end(&mut outputs)?;
    }
    if let Some(view) = view {
        view.finish()?;
    }
    if frames == 0 {
        return Err(match (missing.is_empty(), problems.first()) {
            (false, _) => SessionError::BadRequest {
                what: format!(
                    "the tracker on port {port} sends no {}",
                    missing.iter().map(|joint| joint.name()).collect::<Vec<_>>().join(", ")
                ),
                hint: "let it send a whole body".into(),
            },
            (true, Some(problem)) => SessionError::BadRequest {
                what: format!("what arrives on port {port} is no VMC: {problem}"),
                hint: "check which program sends to this port".into(),
            },
            (true, None) => SessionError::BadRequest {
                what: format!("nothing arrived on port {port} of this machine"),
                hint: "let the tracker send VMC to 127.0.0.1 and this port".into(),
            },
        }
        .into());
    }
    if bad > REPORTED {
        problems.push(format!("skipped: {} more packets", bad - REPORTED));
    }
    context.console.notices(outputs.notices());
    latencies.sort_by(f64::total_cmp);
    let latency = |share: f64| latencies[(share * (latencies.len() - 1) as f64) as usize];
    let json = json!({
        "session": context.session.display().to_string(), "format": "VMC", "port": port, "frames": frames,
        "latency_ms": { "median": latency(0.5), "p95": latency(0.95), "max": latency(1.0) },
        "saved": path.map(|p| p.display().to_string()), "problems": problems, "secs": began.elapsed().as_secs_f64(),
    });
    let mut done = Done::new("drive", json)
        .line(format!("drove {frames} frames of VMC on port {port} in {}", secs(began.elapsed())))
        .line(format!("latency from packet to frame: {:.1} ms, 95 % within {:.1} ms", latency(0.5), latency(0.95)))
        .lines(problems.into_iter().map(|problem| format!("  {problem}")));
    if let Some(path) = path {
        done = done.line(format!("saved {}", path.display()));
        done = done.next(context.overcoat(&format!("animate {}", path.display())));
    }
    Ok(done)
}
