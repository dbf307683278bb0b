//! Outfits: garments that were put on between two scans, so that one scan shows them together for the first time.
//!
//! Each garment is a step of its own. The steps of an outfit follow each other, innermost first, and share everything up to
//! their labels: the scan and how it is read, the pose, and how labels are found.

use super::names::is_file_name;
use super::steps::{BODY_STEP, Recipe, StepRecipe};
use crate::segment::GarmentTemplate;
use crate::session::error::SessionError;
use crate::session::stage::Stage;

/// The stages whose parameters the steps of an outfit share, beside those of reading the scan.
const SHARED: [Stage; 2] = [Stage::Pose, Stage::Segment];

impl Recipe {
    /// The index of the first step that has the scan of step `at`: its own, unless it belongs to an outfit.
    pub(in crate::session) fn first_of_outfit(&self, at: usize) -> usize {
        match self.steps.get(at).and_then(|step| step.outfit.as_ref()) {
            None => at,
            name => (0..at).rev().take_while(|&k| self.steps[k].outfit.as_ref() == name).last().unwrap_or(at),
        }
    }

    /// The steps of the outfit of a step, innermost first; a step that belongs to none alone.
    pub(in crate::session) fn outfit_of(&self, step: &StepRecipe) -> &[StepRecipe] {
        let Some(at) = self.steps.iter().position(|s| s.name == step.name) else { return &[] };
        let first = self.first_of_outfit(at);
        let count = match &step.outfit {
            None => 1,
            name => self.steps[first..].iter().take_while(|s| s.outfit == *name).count(),
        };
        &self.steps[first..first + count]
    }

    /// The index of the first step of each scan that shows new garments, in order.
    pub(in crate::session) fn garment_scans(&self) -> Vec<usize> {
        let begins = |at: &usize| {
            let step = &self.steps[*at];
            !step.is_body() && !step.is_hair() && !step.tryon && self.first_of_outfit(*at) == *at
        };
        (0..self.steps.len()).filter(begins).collect()
    }

    /// An earlier step with the file of step `at`, although it is of another garment; the bare scan is also that of the hair.
    pub(in crate::session) fn same_file(&self, at: usize) -> Option<usize> {
        let step = &self.steps[at];
        let is_of_outfit = |other: &StepRecipe| step.outfit.is_some() && other.outfit == step.outfit;
        let is_same = |other: &StepRecipe| other.hash.is_some() && other.hash == step.hash;
        self.steps[..at]
            .iter()
            .position(|other| !other.is_hair() && !other.estimated && !is_of_outfit(other) && is_same(other))
    }

    /// Appends the steps of an outfit, innermost first, or replaces the steps of the outfit of that name. Steps that keep their
    /// names keep their masks.
    pub(in crate::session) fn put_outfit(
        &mut self,
        outfit: &str,
        mut steps: Vec<StepRecipe>,
        replace: bool,
    ) -> Result<(), SessionError> {
        let is_old = |s: &StepRecipe| s.outfit.as_deref() == Some(outfit);
        let at = self.steps.iter().position(is_old);
        if at.is_some() && !replace {
            return Err(SessionError::BadRequest {
                what: format!("there is already an outfit '{outfit}'"),
                hint: format!(
                    "choose another name, or replace it with `overcoat scan {outfit} FILE --template … --replace`"
                ),
            });
        }
        for step in &mut steps {
            if let Some(old) = self.steps.iter().find(|s| is_old(s) && s.name == step.name) {
                step.masks.clone_from(&old.masks);
            }
        }
        self.steps.retain(|s| !is_old(s));
        for step in &steps {
            self.check_new_garment(&step.name)?;
        }
        let at = at.unwrap_or_else(|| self.place_of_new(&steps));
        self.steps.splice(at..at, steps);
        self.link_templates();
        self.estimated_follows_scan();
        self.check().map_err(|fault| fault.error)
    }

    /// Gives the other steps of an outfit what they share with the named one, and the hair what it shares with the body.
    pub(in crate::session) fn share_in_outfit(&mut self, name: &str) {
        if name == BODY_STEP {
            self.hair_follows_body();
        }
        let Some(of) = self.steps.iter().find(|s| s.name == name && s.outfit.is_some()).cloned() else { return };
        for step in self.steps.iter_mut().filter(|s| s.outfit == of.outfit && s.name != name) {
            *step = with_shared(step, &of);
        }
        self.estimated_follows_scan();
    }

    /// Checks that the steps of an outfit follow each other, share their scan, and are garments of different kinds.
    pub(super) fn check_outfits(&self) -> Result<(), (usize, SessionError)> {
        let wrong = |at: usize, what: String, hint: String| Err((at, SessionError::BadRequest { what, hint }));
        for (at, step) in self.steps.iter().enumerate() {
            let Some(outfit) = &step.outfit else { continue };
            if step.is_body() {
                return wrong(
                    at,
                    format!("the body belongs to no outfit, but to '{outfit}'"),
                    "remove that line".into(),
                );
            }
            if !is_file_name(outfit, &['-', '_']) {
                return wrong(
                    at,
                    format!("'{outfit}' cannot be the name of an outfit"),
                    "use letters, digits, - and _".into(),
                );
            }
            let first = self.first_of_outfit(at);
            if let Some(before) = self.steps[..first].iter().rfind(|s| s.outfit == step.outfit) {
                let what = format!(
                    "the steps '{}' and '{}' of the outfit '{outfit}' have another step between them",
                    before.name, step.name
                );
                return wrong(
                    at,
                    what,
                    "the garments of one scan follow each other: move that step before or after them".into(),
                );
            }
            let other = &self.steps[first];
            if with_shared(step, other) != *step {
                let what = format!(
                    "'{}' and '{}' are garments of one scan, but differ in it or in how it is read, fitted or segmented",
                    other.name, step.name
                );
                return wrong(at, what, "`overcoat step set` changes all garments of an outfit together".into());
            }
            if let Some(twin) = self.steps[first..at].iter().find(|s| s.template == step.template) {
                let kind = step.template.as_deref().unwrap_or_default();
                let what = format!(
                    "the outfit '{outfit}' has the template '{kind}' twice, as '{}' and '{}'",
                    twin.name, step.name
                );
                return wrong(at, what, "give each garment of one scan another kind".into());
            }
        }
        Ok(())
    }
}

/// A garment of an outfit to be added.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::session) struct OutfitGarment {
    pub name: String,
    pub template: GarmentTemplate,
}

/// The garments in the order in which they are worn, innermost first: as their templates have it, except where `over` says
/// otherwise. An entry of `over` is `UPPER:LOWER`, names or templates of two garments. The order of `garments` does not count.
pub(in crate::session) fn inside_out(
    mut garments: Vec<OutfitGarment>,
    over: &[String],
) -> Result<Vec<OutfitGarment>, SessionError> {
    let wrong = |what: String, hint: &str| Err(SessionError::BadRequest { what, hint: hint.into() });
    garments.sort_by(|a, b| {
        let place = |g: &OutfitGarment| (g.template.order_in_outfit(), g.template.name.clone());
        place(a).cmp(&place(b))
    });
    if let Some(twice) = garments.windows(2).find(|two| two[0].template.name == two[1].template.name) {
        let what = format!("the template '{}' is given twice", twice[0].template.name);
        return wrong(what, "list each kind of garment once; the garments of one scan are told apart by their kinds");
    }
    let mut pairs: Vec<[String; 2]> = Vec::new();
    for entry in over {
        let Some((upper, lower)) = entry.split_once(':') else {
            return wrong(
                format!("'{entry}' does not say what is over what"),
                "write --over UPPER:LOWER, such as --over boots:trousers",
            );
        };
        let mut pair = [String::new(), String::new()];
        for (of_pair, typed) in pair.iter_mut().zip([upper.trim(), lower.trim()]) {
            let named =
                garments.iter().find(|g| g.name == typed).or(garments.iter().find(|g| g.template.name == typed));
            let Some(named) = named else {
                let known: Vec<&str> = garments.iter().map(|g| g.name.as_str()).collect();
                return wrong(
                    format!("--over {entry} names '{typed}', but the garments of the outfit are {}", known.join(", ")),
                    "write --over UPPER:LOWER with two of these",
                );
            };
            of_pair.clone_from(&named.name);
        }
        if pair[0] == pair[1] {
            return wrong(format!("--over {entry}: nothing is worn over itself"), "name two garments");
        }
        pairs.push(pair);
    }
    let mut sorted: Vec<OutfitGarment> = Vec::new();
    while !garments.is_empty() {
        let waits = |g: &OutfitGarment| {
            pairs.iter().any(|[upper, lower]| *upper == g.name && garments.iter().any(|o| o.name == *lower))
        };
        let Some(next) = garments.iter().position(|g| !waits(g)) else {
            let left: Vec<&str> = garments.iter().map(|g| g.name.as_str()).collect();
            return wrong(
                format!(
                    "there is no order in which {} are worn as --over says: each would be over another",
                    left.join(", ")
                ),
                "remove one of the --over",
            );
        };
        sorted.push(garments.remove(next));
    }
    Ok(sorted)
}

/// The step with what the steps of an outfit share taken from another one.
fn with_shared(step: &StepRecipe, of: &StepRecipe) -> StepRecipe {
    let mut shared = with_scan_of(step, of);
    for stage in SHARED {
        if let Some(settings) = shared.settings_mut(stage) {
            settings.clone_from(of.settings(stage));
        }
    }
    shared
}

/// The step with the scan of another one, read as that one reads it.
pub(super) fn with_scan_of(step: &StepRecipe, of: &StepRecipe) -> StepRecipe {
    let mut shared = step.clone();
    (shared.scan, shared.hash) = (of.scan.clone(), of.hash);
    (shared.unit, shared.up, shared.faces, shared.voxel_mm) = (of.unit, of.up, of.faces, of.voxel_mm);
    (shared.height, shared.remesh) = (of.height, of.remesh);
    shared.reading.clone_from(&of.reading);
    shared
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Setting;
    use std::path::Path;

    fn recipe() -> Recipe {
        let step = |name: &str, template: Option<&str>, outfit: Option<&str>| StepRecipe {
            name: name.into(),
            scan: if outfit.is_some() { "1.ply".into() } else { format!("{name}.ply") },
            template: template.map(String::from),
            outfit: outfit.map(String::from),
            ..StepRecipe::default()
        };
        let mut recipe = Recipe::new(None);
        recipe.steps = vec![
            step("body", None, None),
            step("jeans", Some("trousers"), Some("summer")),
            step("shirt", Some("shirt"), Some("summer")),
            step("coat", Some("coat"), None),
        ];
        recipe
    }

    #[test]
    fn an_outfit_is_found_from_each_of_its_steps() {
        let recipe = recipe();
        let names =
            |at: usize| -> Vec<&str> { recipe.outfit_of(&recipe.steps[at]).iter().map(|s| s.name.as_str()).collect() };
        assert_eq!([names(0), names(3)], [vec!["body"], vec!["coat"]]);
        assert_eq!([names(1), names(2)], [vec!["jeans", "shirt"], vec!["jeans", "shirt"]]);
        assert_eq!([0, 1, 2, 3].map(|at| recipe.first_of_outfit(at)), [0, 1, 1, 3]);
    }

    #[test]
    fn a_recipe_with_an_outfit_is_written_readably_and_comes_back() {
        let recipe = recipe();
        let text = recipe.to_text().unwrap();
        assert_eq!(text.matches("outfit = \"summer\"").count(), 2, "{text}");
        assert_eq!(Recipe::parse(&text, Path::new("recipe.toml")).unwrap(), recipe);
    }

    #[test]
    fn what_is_set_for_one_garment_holds_for_the_scan() {
        let mut recipe = recipe();
        let shirt = recipe.step_mut("shirt").unwrap();
        (shirt.faces, shirt.until) = (Some(5000), Some("hip".into()));
        shirt.pose.insert("samples".into(), Setting::Count(300));
        shirt.stack.insert("clearance".into(), Setting::Real(0.003));
        assert!(recipe.check().is_err());
        recipe.share_in_outfit("shirt");
        assert!(recipe.check().is_ok());
        let (jeans, coat) = (recipe.step("jeans").unwrap(), recipe.step("coat").unwrap());
        assert_eq!((jeans.faces, &jeans.pose), (Some(5000), &recipe.step("shirt").unwrap().pose));
        assert!(jeans.until.is_none() && jeans.stack.is_empty() && coat.faces.is_none());
    }

    fn sorted(kinds: &str, over: &[&str]) -> Result<Vec<String>, String> {
        let of_kind = |kind: &str| OutfitGarment {
            name: if kind == "shoes" { "boots".into() } else { kind.into() },
            template: GarmentTemplate::built_in(kind).unwrap(),
        };
        let over: Vec<String> = over.iter().map(|entry| entry.to_string()).collect();
        let sorted = inside_out(kinds.split(',').map(of_kind).collect(), &over).map_err(|e| e.to_string())?;
        Ok(sorted.into_iter().map(|g| g.name).collect())
    }

    #[test]
    fn garments_are_sorted_by_their_templates_and_by_what_is_over_what() {
        for listed in ["trousers,shirt,shoes", "shoes,shirt,trousers", "shirt,shoes,trousers"] {
            assert_eq!(sorted(listed, &[]).unwrap(), ["trousers", "shirt", "boots"]);
            assert_eq!(sorted(listed, &["trousers:shirt"]).unwrap(), ["shirt", "trousers", "boots"]);
            assert_eq!(sorted(listed, &["trousers:boots", "boots:shirt"]).unwrap(), ["shirt", "boots", "trousers"]);
            assert_eq!(sorted(listed, &[" shoes : trousers "]).unwrap(), ["trousers", "shirt", "boots"]);
        }
    }

    #[test]
    fn impossible_orders_are_named() {
        let says = |kinds: &str, over: &[&str]| sorted(kinds, over).unwrap_err();
        assert!(says("shirt,coat,shirt", &[]).contains("the template 'shirt' is given twice"));
        assert!(says("shirt,coat", &["shirt"]).contains("'shirt' does not say what is over what"));
        assert!(
            says("shirt,coat", &["hat:coat"]).contains("names 'hat', but the garments of the outfit are shirt, coat")
        );
        assert!(says("shirt,coat", &["coat:coat"]).contains("over itself"));
        let cycle = says("trousers,shirt,shoes", &["shirt:trousers", "trousers:boots", "boots:shirt"]);
        assert!(cycle.contains("no order in which trousers, shirt, boots are worn"), "{cycle}");
    }

    #[test]
    fn an_outfit_is_added_and_replaced_as_a_whole() {
        let mut recipe = recipe();
        let steps = |names: &[&str]| -> Vec<StepRecipe> {
            let step = |name: &&str| StepRecipe {
                name: name.to_string(),
                scan: "9.ply".into(),
                template: Some(name.to_string()),
                outfit: Some("summer".into()),
                ..StepRecipe::default()
            };
            names.iter().map(step).collect()
        };
        recipe.steps[2].masks = vec![Default::default()];
        let says = |result: Result<(), SessionError>| result.unwrap_err().to_string();
        assert!(
            says(recipe.clone().put_outfit("summer", steps(&["vest"]), false)).contains("already an outfit 'summer'")
        );
        assert!(
            says(recipe.clone().put_outfit("summer", steps(&["vest", "coat"]), true)).contains("already a step 'coat'")
        );
        assert!(says(recipe.clone().put_outfit("other", steps(&["shirt"]), false)).contains("already a step 'shirt'"));
        recipe.put_outfit("summer", steps(&["shirt", "vest"]), true).unwrap();
        let names: Vec<&str> = recipe.steps.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, ["body", "shirt", "vest", "coat"]);
        assert_eq!(recipe.steps[1].masks.len(), 1);
        let early = Recipe::new(None).put_outfit("summer", steps(&["shirt"]), false);
        assert!(matches!(early, Err(SessionError::GarmentBeforeBody { .. })));
    }

    #[test]
    fn impossible_outfits_are_named() {
        let says = |change: &dyn Fn(&mut Recipe)| {
            let mut recipe = recipe();
            change(&mut recipe);
            recipe.check().map_err(|fault| fault.error.to_string()).unwrap_err()
        };
        assert!(says(&|r| r.steps[0].outfit = Some("summer".into())).contains("body belongs to no outfit"));
        assert!(says(&|r| r.steps.swap(2, 3)).contains("'jeans' and 'shirt' of the outfit 'summer' have another step"));
        assert!(says(&|r| r.steps[2].scan = "2.ply".into()).contains("garments of one scan"));
        assert!(says(&|r| r.steps[2].template = Some("trousers".into())).contains("'trousers' twice, as 'jeans' and"));
        assert!(
            says(&|r| r.steps.iter_mut().skip(1).take(2).for_each(|s| s.outfit = Some("a/b".into()))).contains("'a/b'")
        );
    }
}
