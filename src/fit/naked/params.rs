//! The parameters of a naked fit.

use crate::fit::error::{FitError, require_range};
use crate::parameters::{Allowed, parameters};
use serde::{Deserialize, Serialize};

/// What a naked fit minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum NakedMethod {
    /// Eq. 4 with robust weights, priors, several initial poses, and limbs that the scan does not show left out.
    Robust,
    /// Hu 2017, Eq. 4 as printed, for comparison. [`fit_naked`](super::fit_naked) with this method never refuses a scan that
    /// has a surface.
    Paper,
}

/// Which scans determine the shape of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ShapeFrom {
    /// The naked scan alone: clothed scans do not change the body.
    Naked,
    /// All scans of the session together.
    All,
}

/// What becomes of hair that the naked scan shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum HairTreatment {
    /// It is left out if the scan would be refused with it, as with long hair; else it counts as part of the body.
    Auto,
    /// It is left out: the head below it comes from face, neck and trunk.
    Drop,
    /// It counts as part of the body.
    Keep,
}

parameters! {
    /// How the naked scan is fitted.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct NakedParams {
        /// What is minimised.
        pub method: NakedMethod =
            NakedMethod::Robust, Allowed::Word(&["robust", "paper"]),
            "What is minimised; `paper`: Eq. 4 of Hu 2017 as printed";
        /// Sample points on the model and on the scan in the last, finest iterations.
        pub samples: usize = 6000, Allowed::SAMPLES, "Sample points on the body model and on the scan";
        /// Greatest number of iterations of the finest phase.
        pub iterations: usize = 30, Allowed::ROUNDS, "Maximum number of iterations";
        /// Strength of the shape prior `|β|²` against residuals in units of 5 mm, one per 4 cm².
        pub shape_prior: f64 = 4.0, Allowed::WEIGHT, "Pull toward the mean shape";
        /// Strength of the pose prior on the same scale.
        pub pose_prior: f64 = 20.0, Allowed::WEIGHT, "Pull toward the bind pose";
        /// Greatest mean distance of the scan from the model, in metres, at which the result is accepted as a body. A scan of
        /// a person in a coat fits a naked model to about 30 mm; chairs and dogs to more than 50.
        pub refuse_above: f64 =
            0.035, Allowed::LENGTH,
            "Mean distance to the scan above which the scan is refused as not a body";
        /// Least share of the scan's surface that the body must explain: 0.98 and more on whole persons, synthetic and real;
        /// an arm in a pose that was not found, or a chair beside the person, is a tenth of the surface.
        pub least_explained: f64 = 0.93, Allowed::SHARE, "Least share of the scan's surface that the body must explain";
        /// Greatest distance of a shape coefficient from the model's mean, in standard deviations: adults stay below 3.5.
        pub greatest_deviation: f64 =
            5.0, Allowed::Real(0.5, 100.0),
            "Greatest shape coefficient, in standard deviations";
        /// Whether a limb that the scan does not show is accepted as missing although some of the scan may be that limb.
        pub missing_limbs: bool =
            false, Allowed::Flag,
            "Treat a limb that is not seen as missing, not as being elsewhere";
        /// Which scans determine the shape.
        pub shape_from: ShapeFrom =
            ShapeFrom::Naked, Allowed::Word(&["naked", "all"]),
            "Which scans set the shape and fill in skin that is not seen; with `all`, each new scan rebuilds everything";
        /// What becomes of hair.
        pub hair: HairTreatment =
            HairTreatment::Auto, Allowed::Word(&["auto", "drop", "keep"]),
            "Hair in the bare scan: `drop` leaves it out, so that the head is that below it; `keep` takes it as part of the body; `auto` drops it only where the scan would be refused with it";
    }
}

impl NakedParams {
    /// **Errors** [`FitError::OutOfRange`] for a value with which no fit is possible.
    pub(crate) fn check(&self) -> Result<(), FitError> {
        require_range("samples", self.samples as f64, 1.0, f64::MAX)?;
        require_range("iterations", self.iterations as f64, 1.0, f64::MAX)?;
        require_range("shape_prior", self.shape_prior, 0.0, f64::MAX)?;
        require_range("pose_prior", self.pose_prior, 0.0, f64::MAX)?;
        require_range("refuse_above", self.refuse_above, 0.0, f64::MAX)?;
        require_range("least_explained", self.least_explained, 0.0, 1.0)?;
        require_range("greatest_deviation", self.greatest_deviation, 0.0, f64::MAX)
    }
}
