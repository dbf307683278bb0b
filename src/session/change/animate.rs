//! Adds animations to a session, and removes them.

use crate::body::Skinning;
use crate::cloth::{ClothMode, ClothSolver};
use crate::motion::{BUILT_IN_CLIPS, FrameRange};
use crate::parameters::Settings;
use crate::session::error::SessionError;
use crate::session::open::{Session, Writer, source};
use crate::session::pipeline::{self, Event, Forced, StageReport, Walk, read_clip};
use crate::session::recipe::AnimationRecipe;
use crate::session::results::{AnimationRecording, ShowIn};
use crate::session::store::ContentHash;
use std::collections::BTreeMap;
use std::path::Path;

/// The request for an animation.
#[derive(Clone, Debug, Default)]
pub struct NewAnimation {
    /// A clip of our own, or a file.
    pub clip: String,
    /// The name of the clip in a file of several; the first if `None`.
    pub clip_name: Option<String>,
    /// Its name in the session; by default the clip's or the file's stem.
    pub name: Option<String>,
    /// Frames per second; the clip's own if `None`.
    pub fps: Option<f64>,
    /// The frames that are used; all if `None`.
    pub frames: Option<FrameRange>,
    /// How joints move the surfaces.
    pub skinning: Option<Skinning>,
    /// Whether and how cloth is simulated; see [`NewAnimation::mode_in`].
    pub mode: Option<ClothMode>,
    /// What computes the physics of cloth.
    pub solver: Option<ClothSolver>,
    /// Fabrics by layer, where they differ from those of the garments.
    pub fabrics: BTreeMap<String, String>,
    /// Parameters of cloth that differ from the defaults.
    pub cloth: Settings,
    /// Parameters of retargeting that differ from the defaults.
    pub motion: Settings,
    /// Target of a recording of the frames.
    pub view: Option<ShowIn>,
    /// Whether the recording may replace a file of the user.
    pub force: bool,
}

impl NewAnimation {
    /// Whether and how cloth is simulated: unless told otherwise, coupled with skinning, where there is cloth.
    pub fn mode_in(&self, session: &Session) -> ClothMode {
        let is_dressed = session.recipe.steps.iter().any(|step| !step.is_body());
        self.mode.unwrap_or(if is_dressed { ClothMode::Coupled } else { ClothMode::Skinned })
    }
}

impl Writer {
    /// Moves the figure by a clip, and adds that to the recipe; returns the reports of its stages. What the figure depends on is built first. An animation of
    /// the same name is replaced.
    ///
    /// **Errors** for a file that is no clip, a clip without a person, a session without scans. On an error the session
    /// has no new animation.
    pub fn animate(
        &mut self,
        new: &NewAnimation,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<(AnimationRecipe, Vec<StageReport>), SessionError> {
        if self.session.recipe.steps.is_empty() {
            return Err(SessionError::NoScans { dir: self.session.dir().to_path_buf() });
        }
        let animation = self.named(new)?;
        let mut recording = match &new.view {
            Some(to) => Some(AnimationRecording::try_new(&self.session.name(), to, self.session.outputs(new.force))?),
            None => None,
        };
        let mut recipe = self.session.recipe.clone();
        recipe.put_animation(animation.clone())?;
        source::keep_missing(&mut self.session)?;
        // The steps are not part of the change; their results are kept if the clip fails.
        let mut walk = Walk::make(self, "build", &Forced::Nothing, on_event);
        let steps = pipeline::steps(&mut walk, None)?;
        let before = std::mem::replace(&mut self.session.recipe, recipe);
        let state = self.session.state.clone();
        let change = format!("animate {}", change_of(&animation));
        let mut on_event = |event: &Event| {
            if let Some(recording) = &mut recording {
                recording.see(event);
            }
            on_event(event);
        };
        let mut walk = Walk::make(self, &change, &Forced::Nothing, &mut on_event).at_once();
        let made = pipeline::animations(&mut walk, &steps, Some(&animation.name));
        let mut reports = walk.into_reports();
        match made {
            Ok(_) => {
                self.save(&change)?;
                if let Some(recording) = recording {
                    recording.show(&self.session, &animation.name)?;
                }
                reports.retain(|report| report.step == animation.key());
                Ok((animation, reports))
            }
            Err(error) => {
                (self.session.recipe, self.session.state) = (before, state);
                Err(error)
            }
        }
    }

    /// Removes an animation.
    pub fn remove_animation(&mut self, name: &str) -> Result<(), SessionError> {
        self.session.recipe.animation(name)?;
        self.session.recipe.animations.retain(|animation| animation.name != name);
        self.save(&format!("animation {name} removed"))
    }

    /// The recipe's entry. A file is read, so that one that is no clip is refused before anything is built.
    fn named(&self, new: &NewAnimation) -> Result<AnimationRecipe, SessionError> {
        let mut animation = AnimationRecipe {
            name: new.clip.clone(),
            clip: new.clip.clone(),
            hash: None,
            clip_name: new.clip_name.clone(),
            fps: new.fps,
            frames: new.frames,
            skinning: new.skinning,
            mode: Some(new.mode_in(&self.session)),
            solver: new.solver,
            fabrics: new.fabrics.clone(),
            cloth: new.cloth.clone(),
            motion: new.motion.clone(),
        };
        if !BUILT_IN_CLIPS.contains(&new.clip.as_str()) {
            let path = Path::new(&new.clip);
            let is_clip = path.extension().is_some_and(|e| {
                ["bvh", "glb", "gltf", "vrma", "npz", "jsonl"].iter().any(|k| e.eq_ignore_ascii_case(k))
            });
            if !is_clip {
                return Err(SessionError::BadRequest {
                    what: format!("'{}' is no clip", new.clip),
                    hint: format!(
                        "name a .bvh, .glb, .gltf, .vrma, .npz or .jsonl file, or one of {}",
                        BUILT_IN_CLIPS.join(", ")
                    ),
                });
            }
            let bytes = source::read(path)?;
            let clip = read_clip(path, &bytes, new.clip_name.as_deref(), None)?;
            let named = source::named(self.session.dir(), path, ContentHash::of(&bytes))?;
            self.session.store.keep_bytes(&bytes)?;
            let name = new.clip_name.as_ref().unwrap_or(&clip.name);
            (animation.clip, animation.hash, animation.name) = (named.file, named.hash, plain_name(name));
        }
        if let Some(name) = &new.name {
            animation.name = name.clone();
        }
        Ok(animation)
    }
}

/// A file's stem with `-` for everything that a name cannot have.
fn plain_name(stem: &str) -> String {
    let plain: String = stem.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '-' }).collect();
    match plain.trim_matches('-') {
        "" => "clip".into(),
        name => name.chars().take(LONGEST_NAME).collect(),
    }
}

/// Longest name, in characters: that of a file.
const LONGEST_NAME: usize = 64;

fn change_of(animation: &AnimationRecipe) -> String {
    let file = animation.clip.rsplit('/').next().unwrap_or_default();
    if file == animation.name { animation.name.clone() } else { format!("{} {file}", animation.name) }
}
