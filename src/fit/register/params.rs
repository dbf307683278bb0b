//! The parameters of a registration.

use crate::fit::error::{FitError, require_range};
use crate::parameters::{Allowed, parameters};
use serde::{Deserialize, Serialize};

parameters! {
    /// How the template is registered to the scan.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct RegisterParams {
        /// Lengths over which the displacement may vary, in metres, one per round of iterations, decreasing.
        pub smoothing_lengths: Vec<f64> =
            vec![0.06, 0.035, 0.02, 0.012, 0.008], Allowed::LENGTHS,
            "Lengths over which the surface may move, one per round";
        /// Iterations per round.
        pub iterations: usize = 3, Allowed::ROUNDS, "Iterations per round";
        /// Greatest distance of a correspondence in the first round, in metres; it falls to a third in the last.
        pub reach: f64 = 0.05, Allowed::LENGTH, "Greatest distance of a correspondence in the first round";
        /// Weight of hands as targets: a scanner merges fingers into mittens, the model has fingers.
        pub hand_pull: f64 = 0.1, Allowed::SHARE, "Share of the pull that acts on the hands";
        /// Weight of toes as targets: a scanner merges them too, but shows the foot's outline.
        pub toe_pull: f64 = 0.5, Allowed::SHARE, "Share of the pull that acts on the toes";
    }
}

impl RegisterParams {
    /// **Errors** [`FitError::OutOfRange`] for a value with which no registration is possible.
    pub(crate) fn check(&self) -> Result<(), FitError> {
        require_range("the number of smoothing_lengths", self.smoothing_lengths.len() as f64, 1.0, f64::MAX)?;
        for &length in &self.smoothing_lengths {
            require_range("smoothing_lengths", length, f64::MIN_POSITIVE, f64::MAX)?;
        }
        require_range("iterations", self.iterations as f64, 1.0, f64::MAX)?;
        require_range("reach", self.reach, f64::MIN_POSITIVE, f64::MAX)?;
        require_range("hand_pull", self.hand_pull, 0.0, 1.0)?;
        require_range("toe_pull", self.toe_pull, 0.0, 1.0)
    }
}
