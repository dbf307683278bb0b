//! Animate: a clip on the figure of the last step. The result is the pose of every frame; the surfaces follow from it when
//! they are exported or drawn.

use crate::body::{Figure, Skeleton};
use crate::formats::{FormatError, SmplMotion, read_bvh, read_gltf_motion, read_pose_lines};
use crate::motion::{Clip, FrameRange, MotionParams, PoseTrack, built_in_clip, follow};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::memo::at::{Code, Run};
use crate::session::pipeline::memo::event::{OnProgress, Outcome, StageProgress};
use crate::session::pipeline::memo::input::{FileInput, ModelInput};
use crate::session::recipe::AnimationRecipe;
use crate::session::stage::Stage;
use crate::session::store::{Kept, Store};
use crate::stack::on_floor;
use serde::Serialize;
use std::path::{Path, PathBuf};

pub(in crate::session::pipeline) const ANIMATE: Code = Code::new(Stage::Animate, 6);

#[derive(Serialize)]
pub(in crate::session::pipeline) struct Inputs {
    pub figure: Kept<Figure>,
    pub model: ModelInput,
    pub clip: ClipInput,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clip_name: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fps: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<FrameRange>,
    pub params: MotionParams,
}

/// A clip of our own, by its name, or that of a file.
#[derive(Serialize)]
#[serde(untagged)]
pub(in crate::session::pipeline) enum ClipInput {
    BuiltIn(String),
    File(FileInput),
}

impl ClipInput {
    pub fn of(session: &Session, animation: &AnimationRecipe) -> Result<Self, SessionError> {
        Ok(match animation.source() {
            None => Self::BuiltIn(animation.clip.clone()),
            // A recipe written by hand may name a file that has no copy yet.
            Some(source) => {
                Self::File(FileInput::at(session.resolve(&source.file), Some(session.source_hash(&source)?)))
            }
        })
    }

    fn load(&self, clip_name: Option<&str>, skeleton: &Skeleton, store: &Store) -> Result<Clip, SessionError> {
        match self {
            Self::BuiltIn(name) => built_in_clip(name).ok_or_else(|| no_clip(name)),
            Self::File(file) => read_clip(file.path(), &file.bytes(store)?, clip_name, Some(skeleton)),
        }
    }
}

pub(in crate::session::pipeline) fn run(
    Inputs { figure, model, clip, clip_name, fps, frames, params }: Inputs,
    store: &Store,
    on_progress: OnProgress,
) -> Run<PoseTrack> {
    let figure = on_floor(model.figure(store, figure)?)?;
    // There is nothing to find out about a clip of our own.
    let is_foreign = matches!(clip, ClipInput::File(_));
    let clip = clip.load(clip_name.as_deref(), &figure.skeleton, store)?;
    on_progress(StageProgress::Text(&format!("{} frames at {:.0} per second", clip.frame_count(), clip.fps())));
    let (track, report) = follow(&clip, &figure, fps, frames, &params)?;
    let (frames, lead) = (track.clip_poses().len(), track.lead);
    Ok(Outcome::of(track)
        .measured("frames", frames as f64)
        .measured("lead_frames", lead as f64)
        .measured("stances", report.stances as f64)
        .measured("limited_joints", report.limited_joints as f64)
        .measured("cleared_deg", report.cleared_deg)
        .measured("raised_mm", report.raised * 1e3)
        .measured("sunk_mm", report.sunk * 1e3)
        .found(report.findings.into_iter().filter(|_| is_foreign)))
}

/// The figure that a step results in, in shoes on their soles: as it is exported and moves.
pub(in crate::session) fn standing(figure: Figure, step: &str) -> Result<Figure, SessionError> {
    on_floor(figure).map_err(|e| SessionError::stage(step, Stage::Stack, e))
}

fn no_clip(name: &str) -> SessionError {
    SessionError::BadRequest {
        what: format!("there is no clip '{name}'"),
        hint: "name a .bvh, .glb, .gltf, .vrma, .npz or .jsonl file, or one of walk, turn, squat, idle".into(),
    }
}

/// Reads the clip of a file; its extension says which format it has. Of several clips in one file, `clip_name` chooses; the
/// first by default. A file without a skeleton has that of the figure, if that is of the same family.
pub fn read_clip(
    path: &Path,
    bytes: &[u8],
    clip_name: Option<&str>,
    skeleton: Option<&Skeleton>,
) -> Result<Clip, SessionError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let raw = match extension.as_str() {
        "bvh" => read_bvh(bytes),
        "glb" | "gltf" | "vrma" => read_gltf_motion(bytes, clip_name),
        _ if clip_name.is_some() => {
            return Err(SessionError::BadRequest {
                what: format!("'{}' cannot hold several clips", path.display()),
                hint: "give --clip-name for a .glb, .gltf or .vrma file".into(),
            });
        }
        "jsonl" => read_pose_lines(bytes),
        "npz" => SmplMotion::read(bytes).map(|motion| {
            let joints = skeleton.filter(|skeleton| skeleton.is_of_smpl_family());
            let joints =
                joints.map(|skeleton| skeleton.joints_in_bind.iter().map(|p| p.coords.into()).collect::<Vec<_>>());
            motion.on_skeleton(joints.as_deref())
        }),
        _ => return Err(no_clip(&path.display().to_string())),
    };
    let raw = raw.map_err(|e: FormatError| SessionError::bad_source(path, e))?;
    let name = PathBuf::from(path).file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(Clip::new(&name, raw))
}
