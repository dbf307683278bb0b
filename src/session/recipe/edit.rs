//! Edits of the list of steps. Each checks the recipe that results.

use super::mask_file::MaskFile;
use super::steps::{Recipe, StepRecipe};
use crate::session::error::SessionError;
use std::path::Path;

/// The new place of a step.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StepPlace {
    /// Before the step of that name.
    Before(String),
    /// After the step of that name.
    After(String),
}

impl StepPlace {
    /// The step beside which it is.
    pub fn beside(&self) -> &str {
        match self {
            Self::Before(name) | Self::After(name) => name,
        }
    }
}

impl Recipe {
    /// Removes a step with its masks, and returns it.
    pub(in crate::session) fn remove_step(&mut self, name: &str) -> Result<StepRecipe, SessionError> {
        let at = self.index_of(name)?;
        let garments: Vec<&str> = self.steps.iter().filter(|s| !s.is_body()).map(|s| s.name.as_str()).collect();
        if self.steps[at].is_body() && !garments.is_empty() {
            return Err(SessionError::BadRequest {
                what: format!("the body cannot be removed while garments are there: {}", garments.join(", ")),
                hint: "remove the garments first, or scan the body again: `overcoat scan body FILE --replace`".into(),
            });
        }
        self.animations.iter_mut().for_each(|animation| drop(animation.fabrics.remove(name)));
        let gone = self.steps.remove(at);
        self.estimated_follows_scan();
        Ok(gone)
    }

    /// Gives a garment another name. Its strokes keep the name that they were painted for.
    pub(in crate::session) fn rename_step(&mut self, old: &str, new: &str) -> Result<(), SessionError> {
        let at = self.index_of(old)?;
        if self.steps[at].is_body() {
            return Err(SessionError::BadRequest {
                what: "the step 'body' cannot be renamed: its name says that it is the bare body".into(),
                hint: "rename a garment".into(),
            });
        }
        let others = Self { steps: [&self.steps[..at], &self.steps[at + 1..]].concat(), ..Self::new(None) };
        others.check_new_garment(new)?;
        for fabrics in self.animations.iter_mut().map(|animation| &mut animation.fabrics) {
            if let Some(fabric) = fabrics.remove(old) {
                fabrics.insert(new.into(), fabric);
            }
        }
        let step = &mut self.steps[at];
        step.name = new.into();
        for mask in step.masks.iter_mut().filter(|mask| MaskFile::holds_strokes(Path::new(&mask.file))) {
            mask.layer = Some(mask.layer.take().unwrap_or_else(|| old.into())).filter(|painted_for| painted_for != new);
        }
        Ok(())
    }

    /// Moves a garment before or after another step; the others keep their order.
    pub(in crate::session) fn move_step(&mut self, name: &str, place: &StepPlace) -> Result<(), SessionError> {
        let refused = |what: String| {
            let hint = "the bare body is the first step, and garments follow from the inside out".into();
            Err(SessionError::BadRequest { what, hint })
        };
        let (from, beside) = (self.index_of(name)?, self.index_of(place.beside())?);
        if from == beside {
            return refused(format!("'{name}' cannot be moved beside itself"));
        }
        if self.steps[from].is_body() {
            return refused("the step 'body' cannot be moved".into());
        }
        if self.steps[beside].is_body() && matches!(place, StepPlace::Before(_)) {
            return refused(format!("'{name}' cannot come before the body"));
        }
        let step = self.steps.remove(from);
        let beside = beside - usize::from(from < beside);
        let at = match place {
            StepPlace::Before(_) => beside,
            StepPlace::After(_) => beside + 1,
        };
        self.steps.insert(at, step);
        self.estimated_follows_scan();
        self.check().map_err(|fault| fault.error)
    }

    fn index_of(&self, name: &str) -> Result<usize, SessionError> {
        self.step(name)?;
        Ok(self.steps.iter().position(|s| s.name == name).expect("the step was found"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::recipe::SourceFile;

    /// A body, a shirt with two masks, and a coat.
    fn recipe() -> Recipe {
        let step = |name: &str, template: Option<&str>| StepRecipe {
            name: name.into(),
            scan: format!("{name}.ply"),
            template: template.map(String::from),
            ..StepRecipe::default()
        };
        let mut recipe = Recipe::new(None);
        recipe.steps = vec![step("body", None), step("shirt", Some("shirt")), step("coat", Some("coat"))];
        let mask = |file: &str| SourceFile { file: file.into(), ..SourceFile::default() };
        recipe.steps[1].masks = vec![mask("dab.jsonl"), mask("masks/shirt-12.ply")];
        recipe
    }

    fn names(recipe: &Recipe) -> Vec<&str> {
        recipe.steps.iter().map(|s| s.name.as_str()).collect()
    }

    #[test]
    fn a_step_moves_to_either_side_of_another() {
        for (name, place, expected) in [
            ("coat", StepPlace::Before("shirt".into()), ["body", "coat", "shirt"]),
            ("coat", StepPlace::After("body".into()), ["body", "coat", "shirt"]),
            ("shirt", StepPlace::After("coat".into()), ["body", "coat", "shirt"]),
            ("coat", StepPlace::After("shirt".into()), ["body", "shirt", "coat"]),
            ("shirt", StepPlace::Before("coat".into()), ["body", "shirt", "coat"]),
        ] {
            let mut recipe = recipe();
            recipe.move_step(name, &place).unwrap();
            assert_eq!(names(&recipe), expected, "{name} {place:?}");
        }
    }

    #[test]
    fn what_makes_the_recipe_invalid_is_refused() {
        let before = |name: &str| StepPlace::Before(name.into());
        let says = |result: Result<(), SessionError>| result.unwrap_err().to_string();
        assert!(says(recipe().move_step("coat", &before("body"))).contains("cannot come before the body"));
        assert!(says(recipe().move_step("body", &StepPlace::After("coat".into()))).contains("cannot be moved"));
        assert!(says(recipe().move_step("coat", &before("coat"))).contains("beside itself"));
        assert!(says(recipe().move_step("hat", &before("coat"))).contains("there is no step 'hat'"));
        assert!(says(recipe().move_step("coat", &before("hat"))).contains("there is no step 'hat'"));
        assert!(says(recipe().remove_step("body").map(drop)).contains("shirt, coat"));
        assert!(says(recipe().rename_step("body", "skin")).contains("cannot be renamed"));
        for taken in ["coat", "Coat", "body", "weights", "a/b", ""] {
            assert!(recipe().rename_step("shirt", taken).is_err(), "{taken}");
        }
    }

    #[test]
    fn strokes_remember_the_name_that_they_were_painted_for() {
        let mut recipe = recipe();
        recipe.rename_step("shirt", "blouse").unwrap();
        assert_eq!(names(&recipe), ["body", "blouse", "coat"]);
        let layers = |recipe: &Recipe| recipe.steps[1].masks.iter().map(|m| m.layer.clone()).collect::<Vec<_>>();
        assert_eq!(layers(&recipe), [Some("shirt".to_string()), None]);
        recipe.rename_step("blouse", "vest").unwrap();
        assert_eq!(layers(&recipe), [Some("shirt".to_string()), None]);
        recipe.rename_step("vest", "shirt").unwrap();
        assert_eq!(recipe, self::recipe());
    }

    #[test]
    fn a_name_may_change_in_upper_and_lower_case_only() {
        let mut recipe = recipe();
        recipe.rename_step("shirt", "Shirt").unwrap();
        assert_eq!(names(&recipe), ["body", "Shirt", "coat"]);
    }

    #[test]
    fn the_last_garment_and_then_the_body_can_be_removed() {
        let mut recipe = recipe();
        assert_eq!(recipe.remove_step("shirt").unwrap().masks.len(), 2);
        recipe.remove_step("coat").unwrap();
        recipe.remove_step("body").unwrap();
        assert!(recipe.steps.is_empty());
    }
}
