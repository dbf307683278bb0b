//! Steps in findings: a stage mentions them by their place, and the name comes in when the finding is reported. So a
//! finding is right after a step was renamed, and equal for equal inputs.

use crate::session::recipe::Recipe;

/// The step of the stage itself. No step can have such a name.
pub(in crate::session::pipeline) const THIS: &str = "{this step}";

/// A step by its index in the recipe; the index must be among the inputs of the stage.
pub(in crate::session::pipeline) fn step(at: usize) -> String {
    format!("{{step {at}}}")
}

/// A garment of the same scan by its place, innermost first.
pub(in crate::session::pipeline) fn garment_of_scan(place: usize) -> String {
    format!("{{garment {place}}}")
}

/// A scan of a garment by its place among those to which the body's shape may be fitted.
pub(in crate::session::pipeline) fn garment_scan(place: usize) -> String {
    format!("{{scan {place}}}")
}

/// The text of a finding of a step, with the names that the steps have now.
pub(in crate::session::pipeline) fn worded(text: &str, recipe: &Recipe, of: &str) -> String {
    if !text.contains('{') {
        return text.into();
    }
    let mut worded = text.replace(THIS, of);
    for (at, other) in recipe.steps.iter().enumerate() {
        worded = worded.replace(&step(at), &other.name);
    }
    for (place, at) in recipe.garment_scans().into_iter().enumerate() {
        worded = worded.replace(&garment_scan(place), &recipe.steps[at].name);
    }
    let own = recipe.steps.iter().find(|step| step.name == of);
    for (place, other) in own.map_or(&[][..], |own| recipe.outfit_of(own)).iter().enumerate() {
        worded = worded.replace(&garment_of_scan(place), &other.name);
    }
    worded
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::recipe::StepRecipe;

    #[test]
    fn a_finding_has_the_names_that_the_steps_have_now() {
        let step_of = |name: &str, outfit: Option<&str>| StepRecipe {
            name: name.into(),
            template: (name != "body").then(|| "shirt".into()),
            outfit: outfit.map(String::from),
            ..StepRecipe::default()
        };
        let mut recipe = Recipe::new(None);
        recipe.steps =
            vec![step_of("body", None), step_of("vest", None), step_of("shirt", Some("o")), step_of("coat", Some("o"))];
        let text = format!("{THIS} is no {}, below {}; {} of 'x'", garment_of_scan(0), step(1), garment_scan(1));
        assert_eq!(worded(&text, &recipe, "coat"), "coat is no shirt, below vest; shirt of 'x'");
        recipe.steps[2].name = "blouse".into();
        assert_eq!(worded(&text, &recipe, "coat"), "coat is no blouse, below vest; blouse of 'x'");
    }
}
