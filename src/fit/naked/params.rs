//! The parameters of a naked fit.

use serde::{Deserialize, Serialize};

/// How the naked scan is fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NakedParams {
    /// SamplePlaces on the model and on the scan that take part in the last, finest iterations.
    pub samples: usize,
    /// Iterations of the finest stage at most.
    pub iterations: usize,
    /// Strength of the shape prior `|β|²` against residuals in units of 5 mm, one a 4 cm².
    pub shape_prior: f64,
    /// Strength of the pose prior on the same scale.
    pub pose_prior: f64,
    /// Greatest mean distance of the scan to the model, in metres, at which the result is taken for a body. A scan of
    /// a person in a coat fits a naked model to about 30 mm; chairs and dogs to more than 50.
    pub refuse_above: f64,
    /// Least share of the scan's surface that the body must explain: 0.98 and more on whole persons, invented and foreign;
    /// an arm in a pose that was not found, or a chair beside the person, is a tenth of the surface.
    pub least_explained: f64,
    /// Greatest distance of a shape coefficient from the model's mean, in standard deviations: grown-ups stay below 3.5.
    pub greatest_deviation: f64,
    /// Whether a limb that is not seen is taken for missing though something in the scan may be it.
    pub missing_limbs: bool,
    /// Which scans make the shape.
    pub shape_from: ShapeFrom,
}

impl Default for NakedParams {
    fn default() -> Self {
        Self {
            samples: 6000,
            iterations: 30,
            shape_prior: 4.0,
            pose_prior: 20.0,
            refuse_above: 0.035,
            least_explained: 0.93,
            greatest_deviation: 5.0,
            missing_limbs: false,
            shape_from: ShapeFrom::Naked,
        }
    }
}

/// What makes the shape of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ShapeFrom {
    /// The naked scan alone: what is worn later changes nothing of the body.
    Naked,
    /// All scans of the session together.
    All,
}
