//! Whether a figure and a scan belong together.

use super::agreement::InsideAgreement;
use super::problem::InsideProblem;
use super::violation::ConstraintViolation;
use crate::body::JointId;
use crate::fit::error::FitError;
use crate::fit::solver::Posed;

impl InsideProblem<'_> {
    pub(crate) fn check_same_person(
        &self,
        residual: f64,
        violation: &ConstraintViolation,
        agreement: &InsideAgreement,
        unseen: &[JointId],
        posed: &Posed,
    ) -> Result<(), FitError> {
        let params = self.params;
        if residual > params.refuse_above {
            return Err(FitError::NotThisPerson { residual_mm: residual * 1e3, limit_mm: params.refuse_above * 1e3 });
        }
        if !params.method.refuses() {
            return Ok(());
        }
        // Limbs that the scan does not show do not count: if the rest is far outside, they are not the cause.
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

    /// A limb that is really missing leaves a hole in the scan where it would begin, and no unexplained surface.
    fn check_unseen_limbs(
        &self,
        unseen: &[JointId],
        agreement: &InsideAgreement,
        posed: &Posed,
    ) -> Result<(), FitError> {
        /// Unexplained share of the surface: 0 to 0.7 % on scans with limbs cut off, 1.5 to 9 % with arms crossed.
        const LIMB: f64 = 0.01;
        /// Greatest distance of the cut from the joint, in metres; its rim is at least as long as the girth of a wrist.
        const CUT: f64 = 0.2;
        const LEAST_RIM: f64 = 0.15;
        for &limb in unseen {
            let rest = 1.0 - agreement.explained;
            let limb_name = self.body.skeleton.part_name(limb);
            let what = if rest > LIMB {
                format!("and {:.1} % of the scan's surface does not match the figure", rest * 100.0)
            } else if self.surface.rim_near(&posed.joints_in_world[limb.index()], CUT) < LEAST_RIM {
                "and the scan has no hole where it would begin".into()
            } else {
                continue;
            };
            return Err(FitError::LimbNotFound { limb: limb_name, what });
        }
        Ok(())
    }
}
