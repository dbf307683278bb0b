//! Shape coordinates from the command line.

use super::error::BodiesError;
use crate::body::BodyModel;

/// Greatest absolute coordinate, in standard deviations: twice that of the rarest person.
const GREATEST: f64 = 10.0;

/// **Errors** if a model has no body with these coordinates.
pub(super) fn check_shape(shape: &[f64], model: &BodyModel) -> Result<(), BodiesError> {
    if shape.len() > model.component_count() {
        return Err(BodiesError::BadRequest {
            what: format!("{} shape coordinates for a model with {}", shape.len(), model.component_count()),
            hint: "give as many as the model has components, or fewer".into(),
        });
    }
    match shape.iter().find(|b| !(-GREATEST..=GREATEST).contains(*b)) {
        None => Ok(()),
        Some(odd) => Err(BodiesError::BadRequest {
            what: format!("{odd} is no shape coordinate of a person"),
            hint: format!("give standard deviations from -{GREATEST} to {GREATEST}, such as 1.5,-2"),
        }),
    }
}
