//! How a model is trained.

use super::error::TrainError;
use serde::{Deserialize, Serialize};

/// How a model is trained.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrainParams {
    /// Components kept: Hu's k.
    pub components: usize,
    /// Number of bodies left out of the training to measure the model on, evenly over the list.
    pub leave_out: usize,
    /// Whether limbs are turned into the mean body's pose before training.
    pub unpose: bool,
}

impl Default for TrainParams {
    fn default() -> Self {
        Self { components: 15, leave_out: 0, unpose: true }
    }
}

impl TrainParams {
    /// Checks that there are enough bodies, before any work is done.
    ///
    /// **Errors** [`TrainError::NoComponentAsked`], [`TrainError::TooFewBodies`].
    pub fn check(&self, bodies: usize) -> Result<(), TrainError> {
        if self.components == 0 {
            return Err(TrainError::NoComponentAsked);
        }
        let kept = bodies.saturating_sub(self.leave_out);
        if kept <= self.components {
            return Err(TrainError::TooFewBodies { components: self.components, bodies: kept });
        }
        Ok(())
    }
}
