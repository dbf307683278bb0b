//! The garment of a step as its recipe describes it: the template, and how far the garment reaches.

use super::steps::StepRecipe;
use crate::segment::{Extent, Fabric, GarmentTemplate};
use crate::session::error::SessionError;
use crate::session::stage_error::StageError;
use crate::session::store::ContentHash;
use serde::{Serialize, Serializer};
use serde_json::json;

/// A template with the limits of one garment: `template`, `until` and `sleeve` of a recipe.
#[derive(Clone)]
pub(in crate::session) struct GarmentSpec {
    pub template: GarmentTemplate,
    pub extent: Extent,
}

/// As an input of a stage: the text of a built-in template is part of the program, so what was read from it is compared.
impl Serialize for GarmentSpec {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let read = ContentHash::of_json(&json!(self.template));
        json!({ "template": self.template.name, "read": read, "extent": self.extent }).serialize(serializer)
    }
}

/// The garment that a step describes.
pub(in crate::session) fn of_step(step: &StepRecipe) -> Result<GarmentSpec, SessionError> {
    let Some(name) = &step.template else {
        return Err(SessionError::GarmentWithoutTemplate { name: step.name.clone() });
    };
    let wrong = |e| SessionError::WrongGarment { step: step.name.clone(), source: Box::new(StageError::Segment(e)) };
    let mut template = match &step.painted.0 {
        Some(painted) if painted.name == *name => painted.as_ref().clone(),
        _ => GarmentTemplate::built_in(name).map_err(wrong)?,
    };
    if let Some(fabric) = &step.fabric {
        Fabric::named(fabric).map_err(wrong)?;
        template.fabric.clone_from(fabric);
    }
    let until = step.until.as_deref().map(str::parse).transpose().map_err(wrong)?;
    let sleeve = step.sleeve.as_deref().map(str::parse).transpose().map_err(wrong)?;
    let extent = Extent { until, sleeve };
    extent.check(&template).map_err(wrong)?;
    Ok(GarmentSpec { template, extent })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input_with(template: &str, change: impl Fn(&mut GarmentTemplate)) -> serde_json::Value {
        let mut template = GarmentTemplate::built_in(template).unwrap();
        change(&mut template);
        json!(GarmentSpec { template, extent: Extent::default() })
    }

    #[test]
    fn the_input_changes_with_what_a_template_covers_and_not_with_its_description() {
        let shirt = input_with("shirt", |_| {});
        assert_eq!(input_with("shirt", |t| t.about = "another text".into()), shirt);
        assert_ne!(input_with("shirt", |t| t.fabric = "denim".into()), shirt);
        assert_ne!(input_with("shirt", |t| t.pieces = 2), shirt);
        assert_ne!(input_with("dress", |t| t.name = "shirt".into()), shirt);
    }
}
