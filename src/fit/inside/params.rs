//! The parameters of a fit inside a scan.

use crate::fit::solver::JointGroup;
use serde::{Deserialize, Serialize};

/// What is solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum InsideMethod {
    /// Eq. 5 where the scan shows the figure or cloth lies close, Eq. 6 with a margin, then the bounded offset.
    Robust,
    /// Eqs. 5–6 plain, for comparison: the whole outside of the figure is drawn to the scan, the constraint has no margin,
    /// and what pose cannot satisfy stays.
    Paper,
}

/// How the figure is laid into the next scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct InsideParams {
    /// What is solved.
    pub method: InsideMethod,
    /// The joints that may turn.
    pub joints: JointGroup,
    /// SamplePlaces on the figure and on the scan that take part in the last iterations.
    pub samples: usize,
    /// Iterations at most.
    pub iterations: usize,
    /// Least distance of hidden body from the observed scan, in metres: about twice the noise that fusion leaves.
    pub margin: f64,
    /// Added to the margin for each garment over the place, in metres: what is observed is the outer face of the cloth.
    pub thickness: f64,
    /// How much of the margin a pose may lack where the offset can make up for it, in metres: noise and a collar's rim
    /// must not move a whole torso.
    pub give: f64,
    /// Greatest inward offset where pose alone cannot satisfy the margin, in metres: breathing moves a chest by less.
    pub greatest_offset: f64,
    /// Whether Eq. 6 is held; off only for comparison.
    pub constrained: bool,
    /// Strength of the pull toward the previous step's pose.
    pub pose_prior: f64,
    /// Greatest mean distance of shown surface from the scan, in metres, at which the two belong together.
    pub refuse_above: f64,
    /// Greatest depth of hidden skin outside the scan, in metres, with which the result is given out: fits of the right
    /// person leave 2 mm, a body that is 12 mm too thick all around 35, hands on the hips 75 and more.
    pub refuse_outside: f64,
    /// Least share of the scan's surface that lies on the figure, or as far from it as its cloth may: a bag or a chair is a
    /// tenth of it.
    pub least_explained: f64,
    /// Whether a limb that is not seen is taken for missing though nothing in the scan says so.
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
            constrained: true,
            pose_prior: 60.0,
            refuse_above: 0.04,
            refuse_outside: 0.05,
            least_explained: 0.9,
            missing_limbs: false,
        }
    }
}
