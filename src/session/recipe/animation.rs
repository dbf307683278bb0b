//! Animations that the user requested: clips that move the figure.

use super::names::is_file_name;
use super::steps::{Recipe, SourceFile};
use crate::body::Skinning;
use crate::motion::{BUILT_IN_CLIPS, FrameRange, MotionParams};
use crate::parameters::{Declared, Parameters, Setting, Settings};
use crate::session::error::SessionError;
use crate::session::store::ContentHash;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::ops::RangeInclusive;

/// Frames per second: below 1 nothing moves, above 240 no camera records.
const FPS: RangeInclusive<f64> = 1.0..=240.0;

/// A clip that moves the figure.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnimationRecipe {
    /// Unique among the animations.
    pub name: String,
    /// The name of a clip of our own, or the clip's file as in [`SourceFile::file`].
    pub clip: String,
    /// The hash of the file's content; none for a clip of our own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hash: Option<ContentHash>,
    /// Frames per second; the clip's own by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fps: Option<f64>,
    /// The frames that are used; all by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<FrameRange>,
    /// How joints move the surfaces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skinning: Option<Skinning>,
    /// Parameters of retargeting, where they differ from the defaults.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub motion: Settings,
}

impl AnimationRecipe {
    /// The name under which its stage is recorded: no step has such a name.
    pub(in crate::session) fn key(&self) -> String {
        format!("animation {}", self.name)
    }

    /// The clip as an input file; `None` for a clip of our own.
    pub(in crate::session) fn source(&self) -> Option<SourceFile> {
        let is_own = self.hash.is_none() && BUILT_IN_CLIPS.contains(&self.clip.as_str());
        let file = || SourceFile { file: self.clip.clone(), hash: self.hash, ..SourceFile::default() };
        (!is_own).then(file)
    }

    /// The parameters of retargeting: the defaults, overridden by the recipe.
    pub(in crate::session) fn params(&self) -> Result<MotionParams, SessionError> {
        let unfit = |e: serde_json::Error| SessionError::BadRequest {
            what: format!("the parameters of the animation '{}' do not fit: {e}", self.name),
            hint: "take them out of the recipe".into(),
        };
        let mut value = serde_json::to_value(MotionParams::default()).map_err(unfit)?;
        if let Value::Object(fields) = &mut value {
            for (name, setting) in &self.motion {
                let number = match setting {
                    // A real parameter accepts an integer.
                    Setting::Count(n) => Value::from(*n as f64),
                    other => serde_json::json!(other),
                };
                fields.insert(name.clone(), number);
            }
        }
        serde_json::from_value(value).map_err(unfit)
    }

    fn check(&self) -> Result<(), SessionError> {
        let wrong = |what: String, hint: &str| Err(SessionError::BadRequest { what, hint: hint.into() });
        if !is_file_name(&self.name, &['-', '_']) {
            return wrong(
                format!("'{}' cannot be the name of an animation", self.name),
                "give --name with letters, digits, - and _",
            );
        }
        if let Some(fps) = self.fps.filter(|fps| !FPS.contains(fps)) {
            return wrong(format!("{fps} frames per second cannot be"), "give --fps between 1 and 240");
        }
        for (name, setting) in &self.motion {
            match motion_parameter(name) {
                Some(declared) if declared.allowed.allows(setting) => {}
                Some(Declared { allowed, about, .. }) => {
                    return wrong(
                        format!("{name} of an animation cannot be '{setting}'"),
                        &format!("{about}: {allowed}"),
                    );
                }
                None => {
                    let names: Vec<_> = MotionParams::declared().iter().map(|declared| declared.name).collect();
                    return wrong(
                        format!("animations have no parameter '{name}'"),
                        &format!("they have {}", names.join(", ")),
                    );
                }
            }
        }
        Ok(())
    }
}

/// The declaration of a parameter of retargeting.
fn motion_parameter(name: &str) -> Option<Declared> {
    MotionParams::declared().into_iter().find(|declared| declared.name == name)
}

impl Recipe {
    /// Adds an animation, or replaces the one of its name.
    pub(in crate::session) fn put_animation(&mut self, animation: AnimationRecipe) -> Result<(), SessionError> {
        match self.animations.iter_mut().find(|there| there.name == animation.name) {
            Some(there) => *there = animation,
            None => self.animations.push(animation),
        }
        self.check_animations()
    }

    /// The animation of that name.
    pub fn animation(&self, name: &str) -> Result<&AnimationRecipe, SessionError> {
        self.animations.iter().find(|animation| animation.name == name).ok_or_else(|| SessionError::BadRequest {
            what: match self.animations.as_slice() {
                [] => format!("there is no animation '{name}': the session has none"),
                all => {
                    let names: Vec<&str> = all.iter().map(|animation| animation.name.as_str()).collect();
                    format!("there is no animation '{name}'; there are {}", names.join(", "))
                }
            },
            hint: "`overcoat animate CLIP` makes one".into(),
        })
    }

    /// Checks that names are valid and unique, and values allowed.
    pub(super) fn check_animations(&self) -> Result<(), SessionError> {
        for (k, animation) in self.animations.iter().enumerate() {
            animation.check()?;
            if self.animations[..k].iter().any(|other| other.name == animation.name) {
                return Err(SessionError::BadRequest {
                    what: format!("there are two animations '{}'", animation.name),
                    hint: "rename one of them".into(),
                });
            }
        }
        Ok(())
    }

    /// The names under which stages are recorded: those of the steps, then of the animations.
    pub(in crate::session) fn record_names(&self) -> Vec<String> {
        let steps = self.steps.iter().map(|step| step.name.clone());
        steps.chain(self.animations.iter().map(AnimationRecipe::key)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn walk() -> AnimationRecipe {
        AnimationRecipe {
            name: "stroll".into(),
            clip: "walk".into(),
            fps: Some(24.0),
            frames: Some(FrameRange { from: 10, to: 90 }),
            skinning: Some(Skinning::DualQuaternion),
            motion: Settings::from([("ease_secs".to_string(), Setting::Real(0.5))]),
            ..AnimationRecipe::default()
        }
    }

    #[test]
    fn an_animation_comes_back_as_it_was_and_a_recipe_without_any_does_not_change() {
        let mut recipe = Recipe::new(None);
        assert!(!recipe.to_text().unwrap().contains("animation"));
        recipe.put_animation(walk()).unwrap();
        let text = recipe.to_text().unwrap();
        assert!(text.contains("frames = \"10..90\"") && text.contains("skinning = \"dq\""), "{text}");
        assert_eq!(Recipe::parse(&text, Path::new("recipe.toml")).unwrap(), recipe);
        assert_eq!(recipe.animation("stroll").unwrap().params().unwrap().ease_secs, 0.5);
        assert_eq!(recipe.record_names(), ["animation stroll"]);
        assert!(recipe.animation("run").unwrap_err().to_string().ends_with("there are stroll"));
    }

    #[test]
    fn a_clip_of_our_own_needs_no_file() {
        assert_eq!(walk().source(), None);
        let file = AnimationRecipe { clip: "../walk.bvh".into(), ..walk() };
        assert_eq!(file.source().map(|source| source.file), Some("../walk.bvh".into()));
    }

    #[test]
    fn what_an_animation_cannot_have_is_named() {
        let text = "version = 1\n[[animation]]\nname = \"walk\"\nclip = \"walk\"\n";
        for (rest, says) in [
            ("fps = 0.5\n", "0.5 frames per second cannot be"),
            ("frames = \"9..3\"\n", "A..B"),
            ("skinning = \"cubes\"\n", "cubes"),
            ("[animation.motion]\nease_secs = -1.0\n", "ease_secs of an animation cannot be '-1'"),
            ("[animation.motion]\nspeed = 2\n", "animations have no parameter 'speed'"),
            ("[[animation]]\nname = \"walk\"\nclip = \"turn\"\n", "there are two animations 'walk'"),
            ("[[animation]]\nname = \"a b\"\nclip = \"turn\"\n", "'a b' cannot be the name of an animation"),
        ] {
            match Recipe::parse(&format!("{text}{rest}"), Path::new("recipe.toml")) {
                Err(SessionError::BadFile { line: Some(_), reason, .. }) => assert!(reason.contains(says), "{reason}"),
                other => panic!("{rest}: {other:?}"),
            }
        }
    }
}
