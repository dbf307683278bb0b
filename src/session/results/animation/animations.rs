//! The animations of a session: whether they are up to date, and their tracks.

use crate::body::{Figure, Skinning};
use crate::cloth::{ClothMode, ClothTrack};
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::motion::PoseTrack;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::{self, Reason, StageReport, Walk, standing};
use crate::session::recipe::AnimationRecipe;
use crate::session::results::status::not_built_is_fine;
use crate::session::results::trims::Trims;
use crate::session::stage::Stage;
use serde::Serialize;

/// The status of an animation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AnimationStatus {
    /// Its name.
    pub name: String,
    /// The clip of our own, or the clip's file.
    pub clip: String,
    /// How its layers move.
    pub mode: ClothMode,
    /// The report of its poses; `None` if it is out of date.
    pub made: Option<StageReport>,
    /// The report of its cloth, if that is simulated and up to date.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cloth: Option<StageReport>,
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
    /// The cloth, if it is simulated and was asked for.
    pub cloth: Option<ClothTrack>,
    /// What its garments carry.
    pub trims: Trims,
}

impl MovedFigure {
    /// The vertices of one layer in one frame, of a figure with or without trim.
    ///
    /// **Shapes** one entry per vertex of the layer.
    pub fn layer(&self, figure: &Figure, rank: usize, frame: usize) -> PerVertex<Point> {
        match &self.cloth {
            None => {
                let (layer, pose) = (&figure.layers[rank], &self.track.poses[frame]);
                self.skinning.skin(layer.mesh.points(), &layer.weights, &figure.skeleton, pose)
            }
            Some(cloth) => {
                self.trims.on(rank, |carrier| cloth.layer(carrier, frame)).unwrap_or_else(|| cloth.layer(rank, frame))
            }
        }
    }

    /// The vertices of every layer in every frame.
    ///
    /// **Shapes** one entry per layer, with one per frame, with one per vertex.
    pub fn layers_by_frame(&self, figure: &Figure) -> Vec<Vec<PerVertex<Point>>> {
        let frames = 0..self.track.poses.len();
        let of_layer = |rank| frames.clone().map(|frame| self.layer(figure, rank, frame)).collect();
        (0..figure.layers.len()).map(of_layer).collect()
    }

    /// Every surface in one frame.
    ///
    /// **Shapes** one mesh per layer of the figure.
    pub fn surfaces(&self, figure: &Figure, frame: usize) -> Vec<TriMesh> {
        let surface = |rank: usize| figure.layers[rank].mesh.with_points(self.layer(figure, rank, frame));
        (0..figure.layers.len()).map(surface).collect()
    }
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
            let mut reports = walk.into_reports();
            reports.retain(|report| own.is_none() && report.step == animation.key());
            let of_stage = |stage| reports.iter().find(|report| report.stage == stage).cloned();
            Ok(AnimationStatus {
                name: animation.name.clone(),
                clip: animation.clip.clone(),
                mode: animation.mode(),
                made: of_stage(Stage::Animate),
                cloth: of_stage(Stage::Cloth),
                why: own.as_ref().map(|stage| stage.why.clone()).unwrap_or_default(),
                failed: own.and_then(|stage| stage.failure).map(|failure| failure.what),
                clip_changed: animation.source().is_some_and(|source| !self.source_is_as_it_was(&source)),
            })
        });
        each.collect()
    }

    /// The figure of the last step, on the floor.
    pub fn figure_of_last_step(&self) -> Result<Figure, SessionError> {
        let steps = pipeline::steps(&mut Walk::look(self), None)?;
        match (steps.last(), self.recipe.steps.last()) {
            (Some(last), Some(step)) => standing(self.figure(last.figure)?, &step.name),
            _ => Err(SessionError::NoScans { dir: self.dir().to_path_buf() }),
        }
    }

    /// The poses of all animations that are up to date, without cloth, and the names of the others.
    pub(in crate::session) fn moved_figures(&self) -> Result<(Vec<MovedFigure>, Vec<String>), SessionError> {
        let (mut moved, mut out_of_date) = (Vec::new(), Vec::new());
        for animation in &self.recipe.animations {
            match self.moved_by(animation, false) {
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
        self.moved_by(animation, true)
    }

    fn moved_by(&self, animation: &AnimationRecipe, with_cloth: bool) -> Result<MovedFigure, SessionError> {
        let mut walk = Walk::look(self);
        let steps = pipeline::steps(&mut walk, None)?;
        let moved = pipeline::animations(&mut walk, &steps, Some(&animation.name))?;
        let fault = || SessionError::Internal { what: format!("the animation '{}' has no track", animation.name) };
        let moved = moved.first().ok_or_else(fault)?;
        let cloth = match moved.cloth.filter(|_| with_cloth) {
            Some(cloth) => Some(self.store.load(cloth)?),
            None => None,
        };
        Ok(MovedFigure {
            name: animation.name.clone(),
            skinning: animation.skinning.unwrap_or_default(),
            track: self.store.load(moved.track)?,
            cloth,
            trims: self.trims(None)?,
        })
    }
}
