//! The animations of a recipe: added, found, checked.

use super::animation::AnimationRecipe;
use super::steps::{Recipe, SourceFile};
use crate::motion::BUILT_IN_CLIPS;
use crate::session::error::SessionError;

impl AnimationRecipe {
    /// The clip as an input file; `None` for a clip of our own.
    pub(in crate::session) fn source(&self) -> Option<SourceFile> {
        let is_own = self.hash.is_none() && BUILT_IN_CLIPS.contains(&self.clip.as_str());
        let file = || SourceFile { file: self.clip.clone(), hash: self.hash, ..SourceFile::default() };
        (!is_own).then(file)
    }
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
            let garments = || self.steps.iter().filter(|step| !step.is_body()).map(|step| step.name.as_str());
            if let Some(layer) = animation.fabrics.keys().find(|name| !garments().any(|garment| garment == *name)) {
                return Err(SessionError::BadRequest {
                    what: format!("there is no garment '{layer}' that could be of another fabric"),
                    hint: match garments().collect::<Vec<_>>().join(", ").as_str() {
                        "" => "scan a garment first".into(),
                        known => format!("the garments are {known}"),
                    },
                });
            }
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
    use crate::body::Skinning;
    use crate::motion::FrameRange;
    use crate::parameters::{Setting, Settings};
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
