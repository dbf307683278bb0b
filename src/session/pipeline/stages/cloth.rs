//! Cloth: the layers of an animation by physics, alone or with skinning. The result is every vertex of every frame.

use crate::body::{Figure, Skinning};
use crate::cloth::{ClothMode, ClothParams, ClothReport, ClothSolver, ClothTrack, simulate};
use crate::geometry::Point;
use crate::motion::PoseTrack;
use crate::session::pipeline::memo::at::{Code, Run};
use crate::session::pipeline::memo::event::{MovedFrame, OnProgress, Outcome, StageProgress};
use crate::session::pipeline::memo::input::ModelInput;
use crate::session::stage::Stage;
use crate::session::store::{Kept, Store};
use crate::stack::on_floor;
use serde::Serialize;
use std::collections::BTreeMap;

pub(in crate::session::pipeline) const CLOTH: Code = Code::new(Stage::Cloth, 7);

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

pub(in crate::session::pipeline) fn run(
    Inputs { figure, model, track, skinning, mode, solver, fabrics, params }: Inputs,
    store: &Store,
    on_progress: OnProgress,
) -> Run<ClothTrack> {
    let figure = dressed_in(&fabrics, on_floor(model.figure(store, figure)?)?);
    let track = store.load(track)?;
    let last = track.poses.len() - 1;
    let mut on_frame = |frame: usize, at: &[Point]| {
        on_progress(StageProgress::Moved(&MovedFrame { figure: &figure, fps: track.fps, frame, at }));
        on_progress(StageProgress::Text(&format!("frame {frame} of {last}")));
    };
    let (cloth, report) = simulate(&figure, skinning, &track, &params, (mode, solver), &mut on_frame)?;
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
