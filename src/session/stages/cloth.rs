//! Cloth: the layers of an animation by physics, alone or with skinning. The result is every vertex of every frame.

use super::animate::{AnimateStage, standing};
use super::event::{OnProgress, Outcome, StageProgress};
use super::pipeline_stage::{PipelineStage, StepContext};
use crate::body::Figure;
use crate::cloth::{ClothMode, ClothParams, ClothReport, ClothSolver, ClothTrack, simulate};
use crate::motion::PoseTrack;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{AnimationRecipe, StepRecipe};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use serde_json::{Value, json};

pub(in crate::session) struct ClothStage;

pub(in crate::session) struct Inputs {
    animation: AnimationRecipe,
    params: ClothParams,
    figure: Kept<Figure>,
    track: Kept<PoseTrack>,
}

/// The body gives way without a word up to this distance in metres, and share of its vertices that move by more than
/// 5 mm: nobody sees it under cloth.
const UNSEEN_YIELD: f64 = 5e-3;
const UNSEEN_SHARE: f64 = 1e-3;

impl PipelineStage for ClothStage {
    const STAGE: Stage = Stage::Cloth;
    const VERSION: u32 = 6;
    type Inputs = Inputs;
    type Output = ClothTrack;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        let fault = || SessionError::Internal { what: "the stage cloth ran without an animation".into() };
        let animation = context.animation.ok_or_else(fault)?.clone();
        let figure = context.inner()?.figure()?;
        let track = context.results.result::<AnimateStage>()?;
        let params = animation.cloth_params()?;
        let skinning = animation.skinning.unwrap_or_default();
        let mut values = json!({ "figure": figure.hash, "track": track.hash, "skinning": skinning, "params": params });
        values["mode"] = json!(animation.mode());
        values["solver"] = json!(animation.solver());
        if !animation.fabrics.is_empty() {
            values["fabrics"] = json!(animation.fabrics);
        }
        Ok((Inputs { animation, params, figure, track }, values))
    }

    fn run(
        Inputs { animation, params, figure, track }: Inputs,
        last: &StepRecipe,
        session: &Session,
        on_progress: OnProgress,
    ) -> Result<Outcome<ClothTrack>, SessionError> {
        let figure = dressed_in(&animation, standing(session.figure(figure)?, last)?);
        let track: PoseTrack = session.store.load(track)?;
        let skinning = animation.skinning.unwrap_or_default();
        let mut on_frame =
            |done: usize, all: usize| on_progress(StageProgress::Text(&format!("frame {done} of {all}")));
        let how = (animation.mode(), animation.solver());
        let (cloth, report) = simulate(&figure, skinning, &track, &params, how, &mut on_frame)
            .map_err(|e| SessionError::Animation { name: animation.name.clone(), source: Box::new(e.into()) })?;
        Ok(Outcome::of(cloth)
            .measured("crossing_pairs", report.crossing_pairs as f64)
            .measured("yielded_mm", report.yielded * 1e3)
            .measured("yielded_percent", report.yielded_share * 100.0)
            .measured("stopped_steps", report.stopped_steps as f64)
            .measured("swing_mm", report.swing * 1e3)
            .measured("hem_swing_mm", report.hem_swing * 1e3)
            .measured("stretch_p99", report.stretch_p99)
            .measured("least_stiffness", report.least_stiffness)
            .found(findings_of(&report, how)))
    }
}

/// The figure with its layers of the fabrics that the animation names.
fn dressed_in(animation: &AnimationRecipe, mut figure: Figure) -> Figure {
    for layer in figure.layers.iter_mut().skip(1) {
        if let Some(fabric) = animation.fabrics.get(&layer.name) {
            layer.fabric = Some(fabric.clone());
        }
    }
    figure
}

/// What a user should know.
fn findings_of(report: &ClothReport, (mode, solver): (ClothMode, ClothSolver)) -> Vec<String> {
    let mut findings = Vec::new();
    if let Some(frame) = report.first_crossing {
        let why = match (mode, solver) {
            (_, ClothSolver::MassSpring) => ": the solver rk4 cannot prevent that; xpbd does",
            (ClothMode::Blended, _) => ": a blend cannot prevent that; --mode coupled does",
            _ => "",
        };
        let pairs = report.crossing_pairs;
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
