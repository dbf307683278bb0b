//! The measures of a session's body.

use crate::body::{BodyMeasure, body_measures};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::BODY_STEP;

impl Session {
    /// The measures of the body as registered to the naked scan.
    ///
    /// **Errors** if the body is not built.
    pub fn body_measures(&self) -> Result<Vec<BodyMeasure>, SessionError> {
        let steps = self.posed_steps(Some(BODY_STEP))?;
        Ok(steps.first().map_or_else(Vec::new, |posed| {
            let body = posed.figure.body();
            body_measures(&body.mesh, &body.weights, &posed.figure.skeleton)
        }))
    }
}
