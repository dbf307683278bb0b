//! A body without a bare scan: its step shares the first scan of clothes, and its fit uses all of them.

use super::known::{KnownMeasures, WEIGHT};
use super::outfit::with_scan_of;
use super::steps::{BODY_STEP, BodySurface, Recipe, StepRecipe};
use crate::body::MEASURE_NAMES;
use crate::session::error::SessionError;

impl Recipe {
    /// Whether the body is estimated from the scans of the dressed person.
    pub fn is_estimated(&self) -> bool {
        self.steps.first().is_some_and(|step| step.estimated)
    }

    /// Adds a body that is estimated, if there is none, and what is known of it.
    ///
    /// **Errors** for known measures of a body that is scanned.
    pub(in crate::session) fn put_estimated(
        &mut self,
        known: &KnownMeasures,
        height: Option<f64>,
    ) -> Result<(), SessionError> {
        if self.steps.is_empty() {
            self.steps.push(StepRecipe { name: BODY_STEP.into(), estimated: true, ..StepRecipe::default() });
        }
        let body = &mut self.steps[0];
        if !body.estimated && !known.is_empty() {
            return Err(SessionError::BadRequest {
                what: "the body is scanned bare, so measures of the person add nothing".into(),
                hint: "leave --weight and --measures out".into(),
            });
        }
        body.known.extend(known.iter().map(|(name, value)| (name.clone(), *value)));
        if body.estimated {
            body.known.extend(height.map(|metres| ("stature".to_string(), metres)));
        }
        Ok(())
    }

    /// Gives an estimated body the first scan of clothes. Without one there is no body either.
    pub(super) fn estimated_follows_scan(&mut self) {
        if !self.is_estimated() {
            return;
        }
        match self.garment_scans().first() {
            None => self.steps.retain(|step| !step.estimated),
            Some(&at) => self.steps[0] = with_scan_of(&self.steps[0], &self.steps[at]),
        }
    }

    /// Checks that an estimated body has the scan from which it is estimated, and nothing that needs a bare one.
    pub(super) fn check_estimated(&self) -> Result<(), (usize, &'static str, SessionError)> {
        let wrong = |at: usize, key, what: String, hint: &str| {
            Err((at, key, SessionError::BadRequest { what, hint: hint.into() }))
        };
        for (at, step) in self.steps.iter().enumerate() {
            if step.estimated && !step.is_body() {
                return wrong(
                    at,
                    "estimated",
                    format!("'{}' is no body: it is scanned", step.name),
                    "remove that line",
                );
            }
            if !step.known.is_empty() && !step.estimated {
                let what = format!("'{}' is scanned, so no measures of it are known beforehand", step.name);
                return wrong(at, "known", what, "remove that section");
            }
        }
        if !self.is_estimated() {
            return Ok(());
        }
        let body = &self.steps[0];
        let again = "or scan the bare body: `overcoat scan body FILE`";
        let Some(&first) = self.garment_scans().first() else {
            let what = "the body is estimated, but no scan shows the person".to_string();
            return wrong(0, "estimated", what, again);
        };
        if with_scan_of(body, &self.steps[first]) != *body {
            let what = format!("the body is estimated, but differs from '{}' in the scan", self.steps[first].name);
            return wrong(0, "scan", what, "give both steps the same file, read in the same way");
        }
        if body.surface == Some(BodySurface::Scan) {
            let what = "the body is estimated, so its surface cannot be the scan, which shows clothes".to_string();
            return wrong(0, "surface", what, again);
        }
        if let Some(at) = self.steps.iter().position(StepRecipe::is_hair) {
            let what = format!("'{}' is cut out of the bare scan, but the body is estimated", self.steps[at].name);
            return wrong(at, "template", what, again);
        }
        if let Some(name) = body.known.keys().find(|name| *name != WEIGHT && !MEASURE_NAMES.contains(&name.as_str())) {
            let what = format!("'{name}' is no measure of a person");
            return wrong(0, "known", what, "`overcoat body measure` lists the measures; the other is weight");
        }
        if let Some((name, value)) = body.known.iter().find(|(_, value)| !(value.is_finite() && **value > 0.0)) {
            return wrong(
                0,
                "known",
                format!("the {name} of a person cannot be {value}"),
                "give it in metres, weight in kg",
            );
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn garment(name: &str, scan: &str, outfit: bool) -> StepRecipe {
        StepRecipe {
            name: name.into(),
            scan: scan.into(),
            template: Some(name.into()),
            outfit: outfit.then(|| "day".into()),
            ..StepRecipe::default()
        }
    }

    fn estimated() -> Recipe {
        let mut recipe = Recipe::new(None);
        recipe.put_estimated(&KnownMeasures::new(), Some(1.7)).unwrap();
        let steps = vec![garment("trousers", "1.ply", true), garment("shirt", "1.ply", true)];
        recipe.put_outfit("day", steps, false).unwrap();
        recipe
    }

    #[test]
    fn an_estimated_body_has_the_first_scan_of_clothes() {
        let mut recipe = estimated();
        assert!(recipe.is_estimated());
        assert_eq!(recipe.steps[0].scan, "1.ply");
        recipe.put_step(garment("coat", "2.ply", false), false).unwrap();
        let text = recipe.to_text().unwrap();
        assert_eq!(Recipe::parse(&text, Path::new("recipe.toml")).unwrap(), recipe);
        for name in ["trousers", "shirt"] {
            recipe.remove_step(name).unwrap();
        }
        assert_eq!(recipe.steps[0].scan, "2.ply");
        recipe.remove_step("coat").unwrap();
        assert!(recipe.steps.is_empty());
    }

    #[test]
    fn a_bare_scan_takes_its_place() {
        let mut recipe = estimated();
        recipe
            .put_step(StepRecipe { name: BODY_STEP.into(), scan: "0.ply".into(), ..StepRecipe::default() }, false)
            .unwrap();
        assert!(!recipe.is_estimated());
        assert_eq!(recipe.steps.len(), 3);
        assert!(recipe.put_estimated(&KnownMeasures::from([(WEIGHT.into(), 70.0)]), None).is_err());
    }

    #[test]
    fn what_needs_a_bare_scan_is_refused() {
        let says = |change: &dyn Fn(&mut Recipe)| {
            let mut recipe = estimated();
            change(&mut recipe);
            recipe.check().map_err(|fault| fault.error.to_string()).unwrap_err()
        };
        assert!(says(&|r| r.steps[0].surface = Some(BodySurface::Scan)).contains("cannot be the scan"));
        assert!(says(&|r| r.steps[0].scan = "9.ply".into()).contains("differs from 'trousers'"));
        assert!(says(&|r| r.steps[1].estimated = true).contains("'trousers' is no body"));
        let negative = |r: &mut Recipe| {
            r.steps[0].known.insert("stature".into(), -1.0);
        };
        assert!(says(&negative).contains("cannot be -1"));
        assert!(says(&|r| r.steps.truncate(1)).contains("no scan shows"));
    }
}
