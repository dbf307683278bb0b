//! The animations of a session: whether they are up to date, and their tracks.

use super::status::not_built_is_fine;
use crate::body::{Figure, Skinning};
use crate::motion::PoseTrack;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::AnimationRecipe;
use crate::session::stages::{Reason, StageReport, Walk, pipeline};
use serde::Serialize;

/// The status of an animation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AnimationStatus {
    /// Its name.
    pub name: String,
    /// The clip of our own, or the clip's file.
    pub clip: String,
    /// What was made; `None` if it is out of date.
    pub made: Option<StageReport>,
    /// Why it is out of date, where that is known; it waits for the steps otherwise.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub why: Vec<Reason>,
    /// Why it failed when it last ran on the same inputs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
    /// The clip's file was changed since it was read, or is gone. The session has its own copy.
    pub clip_changed: bool,
}

/// An animation that is up to date, loaded.
pub(in crate::session) struct MovedFigure {
    pub name: String,
    pub skinning: Skinning,
    pub track: PoseTrack,
}

impl Session {
    /// The status of every animation. Runs nothing.
    pub fn animations(&self) -> Result<Vec<AnimationStatus>, SessionError> {
        let each = self.recipe.animations.iter().map(|animation| {
            let mut walk = Walk::look(self);
            let looked = pipeline::steps(&mut walk, None)
                .and_then(|steps| pipeline::animations(&mut walk, &steps, Some(&animation.name)).map(drop));
            looked.or_else(not_built_is_fine)?;
            let own = walk.out_of_date().iter().find(|stage| stage.step == animation.key()).cloned();
            let made = walk.into_reports().into_iter().find(|report| report.step == animation.key());
            Ok(AnimationStatus {
                name: animation.name.clone(),
                clip: animation.clip.clone(),
                made,
                why: own.as_ref().map(|stage| stage.why.clone()).unwrap_or_default(),
                failed: own.and_then(|stage| stage.failure).map(|failure| failure.what),
                clip_changed: animation.source().is_some_and(|source| !self.source_is_as_it_was(&source)),
            })
        });
        each.collect()
    }

    /// The figure of the last step.
    pub(in crate::session) fn figure_of_last_step(&self) -> Result<Figure, SessionError> {
        let steps = pipeline::steps(&mut Walk::look(self), None)?;
        match steps.last() {
            Some(last) => self.figure(last.figure()?),
            None => Err(SessionError::NoScans { dir: self.dir().to_path_buf() }),
        }
    }

    /// The tracks of all animations that are up to date, and the names of the others.
    pub(in crate::session) fn moved_figures(&self) -> Result<(Vec<MovedFigure>, Vec<String>), SessionError> {
        let (mut moved, mut out_of_date) = (Vec::new(), Vec::new());
        for animation in &self.recipe.animations {
            match self.moved_by(animation) {
                Ok(one) => moved.push(one),
                Err(SessionError::NotBuilt { .. }) => out_of_date.push(animation.name.clone()),
                Err(other) => return Err(other),
            }
        }
        Ok((moved, out_of_date))
    }

    /// The track of the named animation; of the last one in the recipe for `None`.
    pub(in crate::session) fn moved_figure(&self, name: Option<&str>) -> Result<MovedFigure, SessionError> {
        let animation = match (name, self.recipe.animations.last()) {
            (Some(name), _) => self.recipe.animation(name)?,
            (None, Some(last)) => last,
            (None, None) => {
                return Err(SessionError::BadRequest {
                    what: "the session has no animation".into(),
                    hint: "make one: `overcoat animate walk`".into(),
                });
            }
        };
        self.moved_by(animation)
    }

    fn moved_by(&self, animation: &AnimationRecipe) -> Result<MovedFigure, SessionError> {
        let mut walk = Walk::look(self);
        let steps = pipeline::steps(&mut walk, None)?;
        let tracks = pipeline::animations(&mut walk, &steps, Some(&animation.name))?;
        let fault = || SessionError::Internal { what: format!("the animation '{}' has no track", animation.name) };
        let track = self.store.load(*tracks.first().ok_or_else(fault)?)?;
        Ok(MovedFigure { name: animation.name.clone(), skinning: animation.skinning.unwrap_or_default(), track })
    }
}
