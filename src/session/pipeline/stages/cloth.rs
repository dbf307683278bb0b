//! Cloth: the layers of an animation by physics, alone or with skinning. The result is every vertex of every frame.

use crate::body::{Figure, Skinning};
use crate::cloth::{
    ClothCheckpoint, ClothFrame, ClothMode, ClothParams, ClothReport, ClothSolver, ClothTrack, simulate,
};
use crate::geometry::Point;
use crate::motion::PoseTrack;
use crate::session::error::SessionError;
use crate::session::pipeline::memo::at::{Code, Run};
use crate::session::pipeline::memo::event::{MovedFrame, OnProgress, Outcome, StageProgress};
use crate::session::pipeline::memo::input::ModelInput;
use crate::session::stage::Stage;
use crate::session::store::{ContentHash, Derived, Kept, Store};
use crate::stack::on_floor;
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

pub(in crate::session::pipeline) const CLOTH: Code = Code::new(Stage::Cloth, 14);

#[derive(Serialize)]
pub(in crate::session::pipeline) struct Inputs {
    pub figure: Kept<Figure>,
    pub model: ModelInput,
    pub track: Kept<PoseTrack>,
    pub skinning: Skinning,
    pub mode: ClothMode,
    pub solver: ClothSolver,
    /// By layer, where they differ from those of the garments.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub fabrics: BTreeMap<String, String>,
    pub params: ClothParams,
}

/// The body gives way without a word up to this distance in metres, and share of its vertices that move by more than
/// 5 mm: nobody sees it under cloth.
const UNSEEN_YIELD: f64 = 5e-3;
const UNSEEN_SHARE: f64 = 1e-3;

pub(in crate::session::pipeline) fn run(inputs: Inputs, store: &Store, on_progress: OnProgress) -> Run<ClothTrack> {
    let is_kept = inputs.solver == ClothSolver::Constraints && inputs.mode.is_simulated();
    let mut checkpoints = if is_kept { Some(Checkpoints::of(&inputs, store)?) } else { None };
    let Inputs { figure, model, track, skinning, mode, solver, fabrics, params } = inputs;
    let figure = dressed_in(&fabrics, on_floor(model.figure(store, figure)?)?);
    let track = store.load(track)?;
    let last = track.poses.len() - 1;
    let resumed = checkpoints.as_mut().and_then(|checkpoints| checkpoints.load(last));
    let before = resumed.as_ref().map_or(0, |(track, _)| track.frames.len());
    for (frame, points) in resumed.iter().flat_map(|(track, _)| &track.frames).enumerate() {
        let at: Vec<Point> = points.iter().map(|p| Point::from(p.map(f64::from))).collect();
        on_progress(StageProgress::Moved(&MovedFrame { figure: &figure, fps: track.fps, frame, at: &at }));
    }
    if before > 0 {
        on_progress(StageProgress::Text(&format!("resumes after frame {} of {last}", before - 1)));
    }
    let mut on_frame = |frame: &ClothFrame<'_>| {
        let number = frame.number;
        on_progress(StageProgress::Moved(&MovedFrame { figure: &figure, fps: track.fps, frame: number, at: frame.at }));
        on_progress(StageProgress::Text(&format!("frame {number} of {last}")));
        match &mut checkpoints {
            Some(_) if number == last => on_progress(StageProgress::Text(&timings(frame, number + 1 - before))),
            Some(checkpoints) => checkpoints.add(frame),
            None => (),
        }
    };
    let (cloth, report) = simulate(&figure, skinning, &track, &params, (mode, solver), resumed, &mut on_frame)?;
    checkpoints.inspect(Checkpoints::remove);
    Ok(Outcome::of(cloth)
        .measured("crossing_pairs", report.crossing_pairs.map_or(f64::NAN, |pairs| pairs as f64))
        .measured("yielded_mm", report.yielded * 1e3)
        .measured("yielded_percent", report.yielded_share * 100.0)
        .measured("stopped_steps", report.stopped_steps as f64)
        .measured("swing_mm", report.swing * 1e3)
        .measured("hem_swing_mm", report.hem_swing * 1e3)
        .measured("stretch_p99", report.stretch_p99)
        .measured("least_stiffness", report.least_stiffness)
        .found(findings_of(&report, (mode, solver))))
}

/// Time from checkpoint to checkpoint.
const INTERVAL: Duration = Duration::from_secs(10);

/// The checkpoints of an unfinished animation: each holds the frames since the one before it, and the state after them.
struct Checkpoints {
    derived: Derived,
    inputs: ContentHash,
    count: usize,
    /// Frames in all of them.
    frames: usize,
    last: Instant,
}

impl Checkpoints {
    fn of(inputs: &Inputs, store: &Store) -> Result<Self, SessionError> {
        let values = serde_json::to_value((CLOTH.version(), inputs));
        let values = values.map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
        let (derived, inputs) = (store.derived(), ContentHash::of_json(&values));
        Ok(Self { derived, inputs, count: 0, frames: 0, last: Instant::now() })
    }

    fn name(number: usize) -> String {
        format!("cloth-checkpoint-{number}")
    }

    /// The checkpoints of an earlier run of the same inputs, joined; none holds frame number `last`.
    fn load(&mut self, last: usize) -> Option<(ClothTrack, ClothCheckpoint)> {
        let mut resumed: Option<(ClothTrack, ClothCheckpoint)> = None;
        while let Some((first, part, checkpoint)) =
            self.derived.load::<(usize, ClothTrack, ClothCheckpoint)>(&Self::name(self.count), self.inputs)
        {
            // After a damaged checkpoint was written again, the next one may begin at another frame.
            if first != self.frames || first + part.frames.len() > last {
                break;
            }
            self.frames += part.frames.len();
            self.count += 1;
            let mut track =
                resumed.map_or(ClothTrack { vertices: part.vertices, frames: Vec::new() }, |(track, _)| track);
            track.frames.extend(part.frames);
            resumed = Some((track, checkpoint));
        }
        resumed
    }

    fn add(&mut self, frame: &ClothFrame<'_>) {
        if self.last.elapsed() < INTERVAL {
            return;
        }
        let ClothTrack { vertices, frames } = frame.track;
        let part = ClothTrack { vertices: vertices.clone(), frames: frames[self.frames..].to_vec() };
        self.derived.keep(&Self::name(self.count), self.inputs, &(self.frames, part, frame.checkpoint()));
        (self.count, self.frames, self.last) = (self.count + 1, frames.len(), Instant::now());
    }

    fn remove(&self) {
        (0..).take_while(|&number| self.derived.remove(&Self::name(number))).count();
    }
}

/// The mean time per frame in each part of the solver, as text.
fn timings(frame: &ClothFrame<'_>, frames: usize) -> String {
    let of = |(part, time): (&str, Duration)| format!("{part} {:.0}", time.as_secs_f64() * 1e3 / frames.max(1) as f64);
    format!("milliseconds per frame: {}", frame.timings().map(of).join(", "))
}

/// The figure with its layers of the fabrics that the animation names.
fn dressed_in(fabrics: &BTreeMap<String, String>, mut figure: Figure) -> Figure {
    for layer in figure.layers.iter_mut().skip(1) {
        if let Some(fabric) = fabrics.get(&layer.name) {
            layer.fabric = Some(fabric.clone());
        }
    }
    figure
}

/// What a user should know.
fn findings_of(report: &ClothReport, (mode, solver): (ClothMode, ClothSolver)) -> Vec<String> {
    let mut findings = Vec::new();
    if report.crossing_pairs.is_none() {
        findings.push("a draft: nobody looked whether layers cross; without --draft none do".into());
    }
    if let Some(frame) = report.first_crossing {
        let why = match (mode, solver) {
            (_, ClothSolver::MassSpring) => ": the solver rk4 cannot prevent that; xpbd does",
            (ClothMode::Blended, _) => ": a blend cannot prevent that; --mode coupled does",
            _ => "",
        };
        let pairs = report.crossing_pairs.unwrap_or_default();
        findings.push(format!("{pairs} pairs of faces cross in its frames, the first in frame {frame}{why}"));
    }
    if report.yielded > UNSEEN_YIELD && report.yielded_share > UNSEEN_SHARE {
        findings.push(format!(
            "the body gives way to cloth by up to {:.0} mm, on {:.1} % of its vertices by more than 5 mm: limbs are pressed together",
            report.yielded * 1e3,
            report.yielded_share * 100.0
        ));
    }
    if report.stopped_steps > 0 {
        findings.push(format!("the figure stood still for {} steps, as every way was blocked", report.stopped_steps));
    }
    if report.least_stiffness < 1.0 {
        findings.push(format!(
            "the springs have down to {:.2} % of their fabric's stiffness: more would need shorter steps",
            report.least_stiffness * 100.0
        ));
    }
    findings
}
