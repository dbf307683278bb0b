//! Hair as a layer: a step that cuts it out of the bare scan, which it shares with the step of the body.
//!
//! It comes after the garments, because hair lies over them, and before what is worn on the head.

use super::garment_spec;
use super::outfit::with_scan_of;
use super::steps::{BODY_STEP, BodySurface, Recipe, StepRecipe};
use crate::parameters::Setting;
use crate::session::error::SessionError;
use crate::session::stage::Stage;

/// The usual name of the step, and the template that makes a step one of hair.
pub(in crate::session) const HAIR: &str = "hair";
/// The parameter of the naked fit that says what becomes of hair.
const TREATMENT: &str = "hair";

impl StepRecipe {
    /// Whether the step cuts hair out of the bare scan.
    pub(in crate::session) fn is_hair(&self) -> bool {
        !self.is_body() && garment_spec::of_step(self).is_ok_and(|spec| spec.template.grows)
    }

    fn covers_head(&self) -> bool {
        !self.is_body() && garment_spec::of_step(self).is_ok_and(|spec| spec.template.covers_head())
    }
}

impl Recipe {
    /// The index of the last step before the first with the scan of step `at`; `None` for the body. Hair shares the scan of the
    /// body, but is found on the fitted one.
    pub(in crate::session) fn last_before_scan(&self, at: usize) -> Option<usize> {
        match self.steps.get(at).is_some_and(StepRecipe::is_hair) {
            true => Some(0),
            false => self.first_of_outfit(at).checked_sub(1),
        }
    }

    /// Where new steps go: below the hair, unless one of them covers the head.
    pub(super) fn place_of_new(&self, new: &[StepRecipe]) -> usize {
        let outer = if new.iter().any(StepRecipe::is_hair) {
            self.steps.iter().position(StepRecipe::covers_head)
        } else if new.iter().any(StepRecipe::covers_head) {
            None
        } else {
            self.steps.iter().position(StepRecipe::is_hair)
        };
        outer.unwrap_or(self.steps.len())
    }

    /// Adds a step for the hair of the bare scan, if there is none.
    pub(in crate::session) fn put_hair(&mut self) -> Result<(), SessionError> {
        if self.steps.iter().any(StepRecipe::is_hair) {
            return Ok(());
        }
        let step = StepRecipe { name: HAIR.into(), template: Some(HAIR.into()), ..StepRecipe::default() };
        self.put_step(step, false)
    }

    /// Gives an estimated body the scan from which it is estimated, the step of the hair what it shares with that of the body, and makes the fit of the body leave hair out.
    pub(in crate::session) fn hair_follows_body(&mut self) {
        self.estimated_follows_scan();
        let Some(at) = self.steps.iter().position(StepRecipe::is_hair) else { return };
        let Some(body) = self.steps.iter_mut().find(|step| step.is_body()) else { return };
        body.fit.entry(TREATMENT.into()).or_insert_with(|| Setting::Word("drop".into()));
        let body = body.clone();
        self.steps[at] = with_scan_of(&self.steps[at], &body);
    }

    /// Checks that there is one step of hair at most, that it has the bare scan, and that the body does not keep its hair.
    pub(super) fn check_hair(&self) -> Result<(), (usize, SessionError)> {
        let wrong =
            |at: usize, what: String, hint: &str| Err((at, SessionError::BadRequest { what, hint: hint.into() }));
        let Some(body) = self.steps.iter().find(|step| step.is_body()) else { return Ok(()) };
        let mut hair = self.steps.iter().enumerate().filter(|(_, step)| step.is_hair());
        let Some((at, step)) = hair.next() else { return Ok(()) };
        if let Some((second, twin)) = hair.next() {
            let what = format!("'{}' and '{}' are both the hair of the bare scan", step.name, twin.name);
            return wrong(second, what, "one step of hair is enough: leave the other out");
        }
        if step.outfit.is_some() {
            let what = format!("'{}' is hair, which is no garment of an outfit", step.name);
            return wrong(at, what, "it is cut out of the bare scan: `overcoat scan body FILE --hair layer --replace`");
        }
        if with_scan_of(step, body) != *step {
            let what = format!(
                "'{}' is cut out of the bare scan, but differs from '{BODY_STEP}' in it or in how it is read",
                step.name
            );
            return wrong(at, what, "set it for the body: `overcoat step set body …`; the hair follows");
        }
        if body.surface == Some(BodySurface::Scan) {
            let what = format!(
                "the body's surface is the scan itself, hair included, so '{}' would be there twice",
                step.name
            );
            return wrong(0, what, "use the template as the surface, or leave the hair to the body");
        }
        let kept = Setting::Word("keep".into());
        if body.fit.get(TREATMENT) == Some(&kept) {
            let what = format!(
                "the body keeps its hair ({}.{TREATMENT} = \"keep\"), so '{}' has none to cut out",
                Stage::Fit,
                step.name
            );
            return wrong(0, what, "set it to drop, or remove the step of the hair with `overcoat step remove`");
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn step(name: &str, template: Option<&str>) -> StepRecipe {
        StepRecipe {
            name: name.into(),
            scan: format!("{name}.ply"),
            template: template.map(String::from),
            ..StepRecipe::default()
        }
    }

    fn with_hair() -> Recipe {
        let mut recipe = Recipe::new(None);
        recipe.put_step(step("body", None), false).unwrap();
        recipe.put_hair().unwrap();
        recipe
    }

    fn names(recipe: &Recipe) -> Vec<&str> {
        recipe.steps.iter().map(|step| step.name.as_str()).collect()
    }

    #[test]
    fn garments_go_below_the_hair_and_hats_over_it_in_any_order() {
        let kinds = ["shirt", "hat", "coat", "scarf"];
        for turn in 0..kinds.len() {
            let mut recipe = with_hair();
            for kind in kinds.iter().cycle().skip(turn).take(kinds.len()) {
                recipe.put_step(step(kind, Some(kind)), false).unwrap();
            }
            let order = names(&recipe);
            assert_eq!(order[0], "body");
            assert_eq!(order[4..], ["hair", "hat"], "{order:?}");
        }
        let mut late = Recipe::new(None);
        for (name, template) in [("body", None), ("shirt", Some("shirt")), ("hat", Some("hat"))] {
            late.put_step(step(name, template), false).unwrap();
        }
        late.put_hair().unwrap();
        assert_eq!(names(&late), ["body", "shirt", "hair", "hat"]);
        assert_eq!([0, 1, 2, 3].map(|at| late.last_before_scan(at)), [None, Some(0), Some(0), Some(2)]);
    }

    #[test]
    fn hair_has_the_bare_scan_and_the_body_leaves_it_out() {
        let mut recipe = with_hair();
        assert_eq!(recipe.steps[1].scan, "body.ply");
        assert_eq!(recipe.steps[0].fit["hair"], Setting::Word("drop".into()));
        let other = StepRecipe { faces: Some(5000), scan: "again.ply".into(), ..step("body", None) };
        recipe.put_step(other, true).unwrap();
        assert_eq!((recipe.steps[1].faces, recipe.steps[1].scan.as_str()), (Some(5000), "again.ply"));
        let text = recipe.to_text().unwrap();
        assert_eq!(Recipe::parse(&text, Path::new("recipe.toml")).unwrap(), recipe);
    }

    #[test]
    fn impossible_hair_is_named() {
        let says = |change: &dyn Fn(&mut Recipe)| {
            let mut recipe = with_hair();
            change(&mut recipe);
            recipe.check().map_err(|fault| fault.error.to_string()).unwrap_err()
        };
        assert!(says(&|r| r.steps[1].scan = "other.ply".into()).contains("is cut out of the bare scan, but differs"));
        assert!(says(&|r| r.steps[1].outfit = Some("summer".into())).contains("no garment of an outfit"));
        assert!(
            says(&|r| {
                r.steps[0].fit.insert("hair".into(), Setting::Word("keep".into()));
            })
            .contains("keeps its hair")
        );
        assert!(says(&|r| r.steps[0].surface = Some(BodySurface::Scan)).contains("hair included"));
        let twice = |r: &mut Recipe| {
            let twin = StepRecipe { name: "wig".into(), ..r.steps[1].clone() };
            r.steps.push(twin);
        };
        assert!(says(&twice).contains("'hair' and 'wig' are both the hair"));
    }
}
