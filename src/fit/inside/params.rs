//! The parameters of a fit inside a scan.

use crate::fit::error::{FitError, require_range};
use crate::fit::solver::JointGroup;
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

/// How the figure is posed inside the next scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct InsideParams {
    /// What is solved.
    pub method: InsideMethod,
    /// The joints that may turn.
    pub joints: JointGroup,
    /// Sample points on the figure and on the scan in the last iterations.
    pub samples: usize,
    /// Greatest number of iterations.
    pub iterations: usize,
    /// Least distance of hidden body from the observed scan, in metres: about twice the noise that fusion leaves.
    pub margin: f64,
    /// Added to the margin per garment over the place, in metres: the scan shows the outer face of the cloth.
    pub thickness: f64,
    /// How much of the margin a pose may leave to the offset, in metres: noise and a collar's rim must not move a whole
    /// torso.
    pub give: f64,
    /// Greatest inward offset where the pose does not satisfy the margin, in metres: breathing moves a chest by less.
    pub greatest_offset: f64,
    /// Strength of the prior that pulls toward the previous step's pose.
    pub pose_prior: f64,
    /// Greatest mean distance of visible surface from the scan, in metres, at which the two belong together.
    pub refuse_above: f64,
    /// Greatest depth of hidden skin outside the scan, in metres, at which the result is accepted: fits of the right
    /// person leave 2 mm, a body that is 12 mm too thick all around 35, hands on the hips 75 and more.
    pub refuse_outside: f64,
    /// Least share of the scan's surface that the figure, or the stand-off of its cloth, must explain: a bag or a chair is a
    /// tenth of it.
    pub least_explained: f64,
    /// Whether a limb that the scan does not show is accepted as missing without further evidence.
    pub missing_limbs: bool,
}

impl Default for InsideParams {
    fn default() -> Self {
        Self {
            method: InsideMethod::Robust,
            joints: JointGroup::All,
            samples: 4000,
            iterations: 24,
            margin: 0.002,
            thickness: 0.0012,
            give: 0.003,
            greatest_offset: 0.006,
            pose_prior: 60.0,
            refuse_above: 0.04,
            refuse_outside: 0.05,
            least_explained: 0.9,
            missing_limbs: false,
        }
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
