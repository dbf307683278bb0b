//! The parameters of a registration.

use serde::{Deserialize, Serialize};

/// How the template is moved onto the scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RegisterParams {
    /// Lengths over which the displacement may vary, in metres, one a round of iterations, falling.
    pub smoothing_lengths: Vec<f64>,
    /// Iterations a round.
    pub iterations: usize,
    /// Greatest distance of a correspondence in the first round, in metres; it falls to a third in the last.
    pub reach: f64,
    /// How much of the pull hands keep: a scanner's fingers are mittens, the model's are fingers.
    pub hand_pull: f64,
    /// How much of it toes keep: they melt together as fingers do, but the foot's outline is seen.
    pub toe_pull: f64,
}

impl Default for RegisterParams {
    fn default() -> Self {
        Self {
            smoothing_lengths: vec![0.06, 0.035, 0.02, 0.012, 0.008],
            iterations: 3,
            reach: 0.05,
            hand_pull: 0.1,
            toe_pull: 0.5,
        }
    }
}
