//! Whether a figure and a scan belong together.

use super::agreement::Agreement;
use super::params::InsideMethod;
use super::problem::InsideProblem;
use super::violation::ConstraintViolation;
use crate::body::JointId;
use crate::fit::correspondence::display_name;
use crate::fit::error::FitError;
use crate::fit::solver::Posed;

impl InsideProblem<'_> {
    pub(crate) fn check_same_person(
        &self,
        residual: f64,
        violation: &ConstraintViolation,
        agreement: &Agreement,
        unseen: &[JointId],
        posed: &Posed,
    ) -> Result<(), FitError> {
        let params = self.params;
        if residual > params.refuse_above {
            return Err(FitError::NotThisPerson { residual_mm: residual * 1e3, limit_mm: params.refuse_above * 1e3 });
        }
        if params.method == InsideMethod::Paper || !params.constrained {
            return Ok(());
        }
        // Limbs that are not seen do not count here: where the rest is far outside, it is not they that are wrong.
        if violation.spot_depth > params.refuse_outside {
            return Err(FitError::Outside {
                percent: violation.outside_share * 100.0,
                depth_mm: violation.spot_depth * 1e3,
                limit_mm: params.refuse_outside * 1e3,
                near: violation.near(&self.body.skeleton, self.body.weights).unwrap_or_else(|| "body".into()),
            });
        }
        if !params.missing_limbs {
            self.check_unseen_limbs(unseen, agreement, posed)?;
        }
        if agreement.explained < params.least_explained {
            return Err(FitError::Unexplained {
                percent: (1.0 - agreement.explained) * 100.0,
                limit_percent: (1.0 - params.least_explained) * 100.0,
                near: agreement.near.clone().unwrap_or_else(|| "body".into()),
            });
        }
        Ok(())
    }

    /// A limb that is missing leaves a hole where it would begin, and nothing that would be it.
    fn check_unseen_limbs(&self, unseen: &[JointId], agreement: &Agreement, posed: &Posed) -> Result<(), FitError> {
        /// Share of the surface, seen on scans with limbs cut off: 0 to 0.7 %; with arms crossed before the chest: 1.5 to 9.
        const LIMB: f64 = 0.01;
        /// From the joint the cut may lie this far, metres, and its rim is as long as a wrist is around.
        const CUT: f64 = 0.2;
        const LEAST_RIM: f64 = 0.15;
        for &limb in unseen {
            let rest = 1.0 - agreement.explained;
            let limb_name = display_name(&self.body.skeleton.names[limb.index()]);
            let what = if rest > LIMB {
                format!("and {:.1} % of the scan's surface is no part of the figure", rest * 100.0)
            } else if self.surface.rim_near(&posed.joints_in_world[limb.index()], CUT) < LEAST_RIM {
                "and the scan is whole where it would begin".into()
            } else {
                continue;
            };
            return Err(FitError::LimbNotFound { limb: limb_name, what });
        }
        Ok(())
    }
}
