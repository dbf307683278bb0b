//! Animate: a clip on the figure of the last step. The result is the pose of every frame; the surfaces follow from it when
//! they are exported or drawn.

use super::event::{OnProgress, Outcome, StageProgress};
use super::pipeline_stage::{PipelineStage, StepContext};
use crate::body::Figure;
use crate::formats::{FormatError, read_bvh, read_gltf_motion, read_pose_lines};
use crate::motion::{Clip, PoseTrack, built_in_clip, follow};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{AnimationRecipe, StepRecipe};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use crate::stack::on_floor;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

pub(in crate::session) struct AnimateStage;

pub(in crate::session) struct Inputs {
    animation: AnimationRecipe,
    figure: Kept<Figure>,
}

impl PipelineStage for AnimateStage {
    const STAGE: Stage = Stage::Animate;
    const VERSION: u32 = 3;
    type Inputs = Inputs;
    type Output = PoseTrack;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        let fault = || SessionError::Internal { what: "the stage animate ran without an animation".into() };
        let animation = context.animation.ok_or_else(fault)?.clone();
        let figure = context.inner()?.figure()?;
        let session = context.walk.session();
        let clip = match animation.source() {
            None => json!(animation.clip),
            // A recipe written by hand may name a file that has no copy yet.
            Some(source) => json!(session.source_hash(&source)?),
        };
        let mut values = json!({ "figure": figure.hash, "clip": clip, "params": animation.params()? });
        if let Some(fps) = animation.fps {
            values["fps"] = json!(fps);
        }
        if let Some(frames) = animation.frames {
            values["frames"] = json!(frames);
        }
        Ok((Inputs { animation, figure }, values))
    }

    fn run(
        Inputs { animation, figure }: Inputs,
        last: &StepRecipe,
        session: &Session,
        on_progress: OnProgress,
    ) -> Result<Outcome<PoseTrack>, SessionError> {
        let figure = standing(session.figure(figure)?, last)?;
        let clip = match animation.source() {
            None => built_in_clip(&animation.clip).ok_or_else(|| no_clip(&animation.clip))?,
            Some(source) => {
                let path = session.resolve(&source.file);
                read_clip(&path, &session.source_bytes(&source)?)?
            }
        };
        on_progress(StageProgress::Text(&format!("{} frames at {:.0} per second", clip.frame_count(), clip.fps())));
        let params = animation.params()?;
        let (track, report) = follow(&clip, &figure, animation.fps, animation.frames, &params)
            .map_err(|e| SessionError::Animation { name: animation.name.clone(), source: Box::new(e.into()) })?;
        let (frames, lead) = (track.clip_poses().len(), track.lead);
        Ok(Outcome::of(track)
            .measured("frames", frames as f64)
            .measured("lead_frames", lead as f64)
            .measured("stances", report.stances as f64)
            .measured("limited_joints", report.limited_joints as f64)
            .measured("raised_mm", report.raised * 1e3)
            .measured("sunk_mm", report.sunk * 1e3)
            // There is nothing to find out about a clip of our own.
            .found(report.findings.into_iter().filter(|_| animation.source().is_some())))
    }
}

/// The figure that a step results in, in shoes on their soles: as it is exported and moves.
pub(in crate::session) fn standing(figure: Figure, step: &StepRecipe) -> Result<Figure, SessionError> {
    on_floor(figure).map_err(|e| SessionError::stage(&step.name, Stage::Stack, e))
}

fn no_clip(name: &str) -> SessionError {
    SessionError::BadRequest {
        what: format!("there is no clip '{name}'"),
        hint: "name a .bvh, .glb, .gltf or .jsonl file, or one of walk, turn, squat, idle".into(),
    }
}

/// Reads the clip of a file; its extension says which format it has.
pub fn read_clip(path: &Path, bytes: &[u8]) -> Result<Clip, SessionError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let raw = match extension.as_str() {
        "bvh" => read_bvh(bytes),
        "glb" | "gltf" => read_gltf_motion(bytes),
        "jsonl" => read_pose_lines(bytes),
        _ => return Err(no_clip(&path.display().to_string())),
    };
    let raw = raw.map_err(|e: FormatError| SessionError::bad_source(path, e))?;
    let name = PathBuf::from(path).file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(Clip::new(&name, raw))
}
