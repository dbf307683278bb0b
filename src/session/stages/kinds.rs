//! The garments that a scan shows for the first time: one, or those of an outfit.

use crate::body::Figure;
use crate::fit::Cover;
use crate::geometry::PerVertex;
use crate::session::error::SessionError;
use crate::session::recipe::{GarmentSpec, Recipe, StepRecipe};
use crate::session::stage::Stage;
use serde_json::{Value, json};

/// The garments that a scan shows for the first time, innermost first.
pub(in crate::session) struct NewGarments(pub Vec<GarmentSpec>);

impl NewGarments {
    /// Those of the scan of a step.
    pub fn of(recipe: &Recipe, step: &StepRecipe) -> Result<Self, SessionError> {
        recipe.garments_of_outfit(step).map(Self)
    }

    /// Adds them to the inputs of a stage. `is_outfit` says whether the step belongs to an outfit.
    pub fn among(&self, mut values: Value, is_outfit: bool) -> Value {
        let mut inputs: Vec<Value> = self.0.iter().map(GarmentSpec::input).collect();
        match is_outfit {
            true => values["kinds"] = json!(inputs),
            false => values["kind"] = inputs.pop().unwrap_or_default(),
        }
        values
    }

    /// Whether this is the hair of the bare scan.
    pub fn are_hair(&self) -> bool {
        self.0.iter().any(|spec| spec.template.grows)
    }

    /// How they cover the body together: a place is loose if it is so in one of them. What hair covers is known otherwise.
    ///
    /// **Shapes** one entry per vertex of the body.
    ///
    /// **Errors** if a template was painted on another body.
    pub fn cover(&self, figure: &Figure, step: &str) -> Result<PerVertex<Cover>, SessionError> {
        let mut covered = PerVertex::filled(Cover::Bare, figure.body().mesh.vertex_count());
        for spec in self.0.iter().filter(|spec| !spec.template.grows) {
            let new = (spec.template.cover(figure.body(), &figure.skeleton, &spec.extent))
                .map_err(|e| SessionError::stage(step, Stage::Pose, e))?;
            covered = covered.iter().zip(new.iter()).map(|(a, b)| looser(*a, *b)).collect();
        }
        Ok(covered)
    }
}

/// The cover of a place that two garments cover.
pub(super) fn looser(a: Cover, b: Cover) -> Cover {
    match (a, b) {
        (Cover::Loose, _) | (_, Cover::Loose) => Cover::Loose,
        (Cover::Tight, _) | (_, Cover::Tight) => Cover::Tight,
        _ => Cover::Bare,
    }
}
