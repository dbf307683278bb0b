//! The painted kinds of a recipe: their files, their names, and the steps that use them.

use super::garment_spec::{self, GarmentSpec};
use super::names::{is_file_name, is_same_file_name};
use super::painted_kind::PaintedKind;
use super::steps::{Recipe, SourceFile, StepRecipe};
use crate::segment::{GarmentTemplate, SegmentError};
use crate::session::error::SessionError;
use crate::session::stage_error::StageError;

/// The folder of the painted kinds, beside the recipe.
pub(in crate::session) const TEMPLATES: &str = "templates";

impl PaintedKind {
    /// Its file as a source.
    pub(in crate::session) fn source(&self) -> SourceFile {
        SourceFile { file: format!("{TEMPLATES}/{}.toml", self.name), hash: self.hash, ..SourceFile::default() }
    }
}

impl StepRecipe {
    /// The kind of the step's garment; `None` for the body.
    pub(in crate::session) fn garment_template(&self) -> Option<GarmentTemplate> {
        garment_spec::of_step(self).ok().map(|spec| spec.template)
    }
}

impl Recipe {
    /// The kind of garment of that name: painted for this session, or built in.
    pub fn template(&self, name: &str) -> Result<GarmentTemplate, SegmentError> {
        if let Some(template) = self.painted(name).and_then(|kind| kind.template.0.as_ref()) {
            return Ok(template.as_ref().clone());
        }
        GarmentTemplate::built_in(name).map_err(|error| match error {
            SegmentError::UnknownTemplate { name, mut known, nearest } => {
                known.extend(self.templates.iter().map(|kind| kind.name.clone()));
                SegmentError::UnknownTemplate { name, known, nearest }
            }
            other => other,
        })
    }

    /// The garment of a step of this recipe. An unknown kind is answered with all kinds, also the painted ones.
    pub(in crate::session) fn garment_of(&self, step: &StepRecipe) -> Result<GarmentSpec, SessionError> {
        if let Some(name) = &step.template {
            self.template(name).map_err(|e| {
                let source = Box::new(StageError::Segment(e));
                SessionError::WrongGarment { step: step.name.clone(), source }
            })?;
        }
        garment_spec::of_step(step)
    }

    /// The painted kinds, in the order in which they were added.
    pub fn painted_templates(&self) -> Vec<GarmentTemplate> {
        self.templates.iter().filter_map(|kind| kind.template.0.as_deref().cloned()).collect()
    }

    pub(in crate::session) fn painted(&self, name: &str) -> Option<&PaintedKind> {
        self.templates.iter().find(|kind| kind.name == name)
    }

    /// Gives each step the painted kind that its template names. Needed after a change of either.
    pub(in crate::session) fn link_templates(&mut self) {
        for step in &mut self.steps {
            let kind = self.templates.iter().find(|kind| Some(&kind.name) == step.template.as_ref());
            step.painted = kind.map(|kind| kind.template.clone()).unwrap_or_default();
        }
    }

    /// Checks whether a painted kind may have a name. A kind of that name may exist: it is painted again.
    pub(in crate::session) fn check_kind_name(&self, name: &str) -> Result<(), SessionError> {
        let refuse = |what: String, hint: &str| Err(SessionError::BadRequest { what, hint: hint.into() });
        if let Ok(built_in) = GarmentTemplate::built_in(name) {
            let what = format!("'{}' is a built-in kind of garment", built_in.name);
            return refuse(what, "choose another name; --like makes the new kind similar to a built-in one");
        }
        if !is_file_name(name, &['-', '_']) {
            let what = format!("'{name}' cannot be the name of a kind of garment");
            return refuse(what, "use letters, digits, - and _, such as poncho");
        }
        match self.templates.iter().find(|kind| kind.name != name && is_same_file_name(&kind.name, name)) {
            None => Ok(()),
            Some(there) => refuse(
                format!("the name '{name}' differs from the kind '{}' only in upper and lower case", there.name),
                "choose another name: some file systems do not tell the two apart",
            ),
        }
    }

    /// Checks the names of the painted kinds.
    pub(super) fn check_templates(&self) -> Result<(), SessionError> {
        for (k, kind) in self.templates.iter().enumerate() {
            self.check_kind_name(&kind.name)?;
            if self.templates[..k].iter().any(|other| other.name == kind.name) {
                return Err(SessionError::BadRequest {
                    what: format!("there are two kinds of garment '{}'", kind.name),
                    hint: "remove one of them".into(),
                });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::recipe::LoadedTemplate;
    use crate::session::store::ContentHash;
    use std::path::Path;
    use std::sync::Arc;

    fn recipe() -> Recipe {
        let mut template = GarmentTemplate::built_in("coat").unwrap();
        (template.name, template.rank) = ("poncho".into(), 77);
        let loaded = LoadedTemplate(Some(Arc::new(template)));
        let kind = PaintedKind { name: "poncho".into(), hash: Some(ContentHash::of(b"p")), template: loaded };
        let step = |name: &str, template: &str| StepRecipe {
            name: name.into(),
            template: Some(template.into()),
            ..StepRecipe::default()
        };
        let body = StepRecipe { name: "body".into(), ..StepRecipe::default() };
        let steps = vec![body, step("red", "poncho"), step("shirt", "tshirt")];
        Recipe { templates: vec![kind], steps, ..Recipe::new(None) }
    }

    #[test]
    fn a_step_finds_its_painted_kind_once_it_is_linked() {
        let mut recipe = recipe();
        assert!(garment_spec::of_step(&recipe.steps[1]).is_err());
        recipe.link_templates();
        assert_eq!(garment_spec::of_step(&recipe.steps[1]).unwrap().template.rank, 77);
        assert_eq!(garment_spec::of_step(&recipe.steps[2]).unwrap().template.name, "tshirt");
        // Another template of the step, not linked yet.
        recipe.steps[1].template = Some("coat".into());
        assert_eq!(garment_spec::of_step(&recipe.steps[1]).unwrap().template.rank, 60);
        assert_eq!(recipe.template("poncho").unwrap().rank, 77);
        let unknown = recipe.template("ponchi").unwrap_err().to_string();
        assert!(unknown.ends_with("vest, poncho"), "{unknown}");
        recipe.steps[1].template = Some("ponchi".into());
        let unknown = recipe.garment_of(&recipe.steps[1]).err().map(|e| e.to_string());
        assert!(unknown.as_ref().is_some_and(|e| e.ends_with("vest, poncho")), "{unknown:?}");
    }

    #[test]
    fn names_of_kinds_are_file_names_and_not_built_in() {
        let recipe = recipe();
        assert!(recipe.check_kind_name("poncho").is_ok() && recipe.check_kind_name("my-poncho_2").is_ok());
        for (name, says) in [
            ("tshirt", "'tshirt' is a built-in kind"),
            ("T-Shirt", "'tshirt' is a built-in kind"),
            ("a/b", "cannot be the name"),
            ("", "cannot be the name"),
            ("Poncho", "only in upper and lower case"),
        ] {
            let error = recipe.check_kind_name(name).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
    }

    #[test]
    fn the_recipe_s_text_keeps_kinds_and_refuses_two_of_one_name() {
        let recipe = recipe();
        let text = recipe.to_text().unwrap();
        assert!(text.contains("[[template]]\nname = \"poncho\"\nhash = "), "{text}");
        let back = Recipe::parse(&text, Path::new("recipe.toml")).unwrap();
        assert_eq!(back, recipe, "a kind that is not loaded is equal to a loaded one");
        assert!(!Recipe::new(None).to_text().unwrap().contains("template"));
        let other =
            Recipe { templates: vec![PaintedKind { hash: None, ..recipe.templates[0].clone() }], ..recipe.clone() };
        assert!(other != recipe && other.meaning() != recipe.meaning());
        let twice = text.replace("[[template]]", "[[template]]\nname = \"poncho\"\n\n[[template]]");
        let error = Recipe::parse(&twice, Path::new("recipe.toml")).unwrap_err().to_string();
        assert!(error.contains("two kinds of garment 'poncho'"), "{error}");
    }
}
