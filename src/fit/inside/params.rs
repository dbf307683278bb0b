//! The parameters of a fit inside a scan.

use crate::fit::error::{FitError, require_range};
use crate::fit::solver::JointGroup;
use crate::parameters::{Allowed, parameters};
use serde::{Deserialize, Serialize};

/// What a fit inside a scan solves. All but `Robust` exist for comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum InsideMethod {
    /// Eq. 5 where the scan shows the figure or cloth is close to it, Eq. 6 with a margin, then the bounded offset.
    Robust,
    /// Hu 2017, Eqs. 5–6 as printed: the body's normals and closest points, and nothing of ours. The fit refuses no scan
    /// that has a surface.
    Paper,
    /// Ablation: `Robust` without the constraint of Eq. 6 and without the offset.
    Unconstrained,
    /// Ablation: `Robust` without confidence of the scan, inlier weights of cloth and weights of the constraint: everything
    /// that takes part counts fully.
    Unweighted,
    /// Eqs. 5–6 with our solver: the whole outside of the figure is drawn to the scan, the constraint has no margin and no
    /// offset follows. Initial poses, robust weights, scan confidence, slack and pose prior are ours.
    Hybrid,
}

impl InsideMethod {
    /// Whether skin is offset inward where the pose does not satisfy the margin.
    pub(super) fn has_offset(self) -> bool {
        matches!(self, Self::Robust | Self::Unweighted)
    }

    /// Whether steps are constrained by Eq. 6.
    pub(super) fn is_constrained(self) -> bool {
        self != Self::Unconstrained
    }

    /// Whether what the scan shows worse, or what cloth hides, counts less.
    pub(super) fn is_weighted(self) -> bool {
        self != Self::Unweighted
    }

    /// Whether a result that does not match the scan is refused.
    pub(super) fn refuses(self) -> bool {
        self.has_offset()
    }
}

parameters! {
    /// How the figure is posed inside the next scan.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct InsideParams {
        /// What is solved.
        pub method: InsideMethod =
            InsideMethod::Robust, Allowed::Word(&["robust", "paper", "unconstrained", "unweighted", "hybrid"]),
            "What is solved; `paper`: Eqs. 5 and 6 of Hu 2017 as printed; the last three only for comparison";
        /// The joints that may turn.
        pub joints: JointGroup =
            JointGroup::All, Allowed::Word(&["all", "arms", "legs", "limbs", "head", "trunk"]),
            "The joints that may rotate; the root always does";
        /// Sample points on the figure and on the scan in the last iterations.
        pub samples: usize = 4000, Allowed::SAMPLES, "Sample points on the figure and on the scan";
        /// Greatest number of iterations.
        pub iterations: usize = 24, Allowed::ROUNDS, "Maximum number of iterations";
        /// Least distance of hidden body from the observed scan, in metres: about twice the noise that fusion leaves.
        pub margin: f64 = 0.002, Allowed::SHORT, "Least distance of hidden body from the scan";
        /// Added to the margin per garment over the place, in metres: the scan shows the outer face of the cloth.
        pub thickness: f64 = 0.0012, Allowed::SHORT, "Added to the margin for each garment over the skin";
        /// Depth by which the pose may fall short of the margin, in metres; the offset makes up for it. Noise and a
        /// collar's rim must not move a whole torso.
        pub give: f64 = 0.003, Allowed::SHORT, "Depth by which the pose may fall short of the margin; the offset makes up for it";
        /// Greatest inward offset where the pose does not satisfy the margin, in metres: breathing moves a chest by less.
        pub greatest_offset: f64 = 0.006, Allowed::SHORT, "Greatest inward offset of the skin";
        /// Strength of the prior that pulls toward the previous step's pose.
        pub pose_prior: f64 = 60.0, Allowed::WEIGHT, "Pull toward the pose of the step before";
        /// Greatest mean distance of visible surface from the scan, in metres, at which the two belong together.
        pub refuse_above: f64 =
            0.04, Allowed::LENGTH,
            "Mean distance to the scan above which it is refused as another person";
        /// Greatest depth of hidden skin outside the scan, in metres, at which the result is accepted: fits of the right
        /// person leave 2 mm, a body that is 12 mm too thick all around 35, hands on the hips 75 and more.
        pub refuse_outside: f64 =
            0.05, Allowed::LENGTH,
            "Depth of hidden skin outside the scan above which it is refused as another person";
        /// Least share of the scan's surface that the figure, or the stand-off of its cloth, must explain: a bag or a chair is a
        /// tenth of it.
        pub least_explained: f64 =
            0.9, Allowed::SHARE,
            "Least share of the scan's surface that figure and cloth must explain";
        /// Whether a limb that the scan does not show is accepted as missing without further evidence.
        pub missing_limbs: bool =
            false, Allowed::Flag,
            "Treat a limb that is not seen as missing, not as being elsewhere";
    }
}

impl InsideParams {
    /// **Errors** [`FitError::OutOfRange`] for a value with which no fit is possible.
    pub(crate) fn check(&self) -> Result<(), FitError> {
        require_range("samples", self.samples as f64, 1.0, f64::MAX)?;
        require_range("iterations", self.iterations as f64, 1.0, f64::MAX)?;
        for (what, value) in [
            ("margin", self.margin),
            ("thickness", self.thickness),
            ("give", self.give),
            ("greatest_offset", self.greatest_offset),
            ("pose_prior", self.pose_prior),
            ("refuse_above", self.refuse_above),
            ("refuse_outside", self.refuse_outside),
        ] {
            require_range(what, value, 0.0, f64::MAX)?;
        }
        require_range("least_explained", self.least_explained, 0.0, 1.0)
    }
}
