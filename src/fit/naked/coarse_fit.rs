//! Fits of downsampled copies: many initial poses in the time of one fine fit.

use super::params::NakedParams;
use crate::body::{Pose, Shape};
use crate::fit::correspondence::{Downsampled, DownsampledModel, ScanSurface};
use crate::fit::solver::{
    DAMPING, Phase, PosePrior, Singular, StoppingRule, Unknowns, iterate, limbs_only, pose_stiffness,
};

/// Downsampled copies of model and scan, with the priors of a fit.
pub(crate) struct CoarseFit<'a> {
    pub(crate) downsampled: Downsampled<'a>,
    stiffness: Vec<f64>,
    shape_prior: f64,
}

impl<'a> CoarseFit<'a> {
    pub(crate) fn prepare(model: &'a DownsampledModel, surface: &ScanSurface, params: &NakedParams) -> Self {
        let downsampled = Downsampled::prepare(model, surface);
        let stiffness = pose_stiffness(&downsampled.body.skeleton, params.pose_prior);
        Self { downsampled, stiffness, shape_prior: params.shape_prior }
    }

    /// Some Gauss–Newton steps from `pose` and `shape`.
    pub(crate) fn fit(&self, phase: &Phase, pose: Pose, shape: Shape) -> (Pose, Shape) {
        let (mut pose, mut shape) = (pose, shape);
        let body = &self.downsampled.body;
        let center = Pose::bind(body.joint_count());
        let limits = self.downsampled.limits();
        let limbs = limbs_only(&body.skeleton);
        let joints = limbs.iter().map(|is_limb| *is_limb || !phase.limbs_only).collect();
        let unknowns = Unknowns::without_fingers(&body.skeleton, joints, phase.shape);
        iterate(&StoppingRule::always(phase.iterations), |_| {
            let posed = body.posed(&pose, &shape);
            let mut equations = body.normal_equations(&posed, &self.downsampled.residuals(&posed, phase), &unknowns);
            let prior = PosePrior { center: &center, stiffness: &self.stiffness, limits };
            equations.add_pose_prior(&posed, &pose, &prior);
            equations.add_shape_prior(&shape, self.shape_prior);
            equations.freeze_all_but(&unknowns);
            let delta = equations.solve(DAMPING)?;
            (pose, shape) = body.stepped(&posed, &pose, &shape, &delta);
            Ok::<_, Singular>(f64::INFINITY)
        });
        (pose, shape)
    }

    /// Mean truncated distance both ways, in metres: comparable between poses whatever their correspondences.
    pub(crate) fn score(&self, pose: &Pose, shape: &Shape) -> f64 {
        self.downsampled.score(pose, shape)
    }
}
