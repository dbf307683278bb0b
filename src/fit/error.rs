//! Why a fit has no result.

/// Why a fit has no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The scan has no faces.
    #[error("the scan has no surface to fit a body to")]
    EmptyScan,
    /// An array has the wrong length.
    #[error("{what}: {given} values, expected {expected}")]
    WrongLength {
        /// Which array, and what it has one value for.
        what: &'static str,
        /// Its length.
        given: usize,
        /// The length it must have.
        expected: usize,
    },
    /// A number is outside its range.
    #[error("{what} is {given}, expected {least} to {greatest}")]
    OutOfRange {
        /// Which number.
        what: &'static str,
        /// Its value.
        given: f64,
        /// The least allowed value.
        least: f64,
        /// The greatest allowed value.
        greatest: f64,
    },
    /// Two parameters exclude each other.
    #[error("{first} cannot be combined with {second}")]
    Contradiction {
        /// One parameter and its value.
        first: &'static str,
        /// The other.
        second: &'static str,
    },
    /// No initial pose explains the scan.
    #[error(
        "the scan does not look like a naked standing person: the best fit is {residual_mm:.0} mm off on average, over the limit of {limit_mm:.0} mm"
    )]
    NotABody {
        /// Mean distance of the best fit.
        residual_mm: f64,
        /// The limit.
        limit_mm: f64,
    },
    /// The scan shows something besides a body, or a body in a pose that was not found.
    #[error(
        "{percent:.0} % of the scan's surface does not match the best fit, most of it at the {near}; {limit_percent:.0} % are allowed"
    )]
    Unexplained {
        /// Share of the scan's area.
        percent: f64,
        /// The limit.
        limit_percent: f64,
        /// The part of the body next to it.
        near: String,
    },
    /// The scan does not show a part of the body that the fit cannot do without.
    #[error("the scan shows {seen_percent:.0} % of a body, and almost nothing of its {region}")]
    HalfABody {
        /// The missing part.
        region: String,
        /// Share of the body's area that the scan shows.
        seen_percent: f64,
    },
    /// The body is far outside the range of the model, for example a child in a model of adults.
    #[error(
        "the best fit is {deviation:.1} standard deviations from the mean of the body model, over the limit of {limit:.1}: the model does not cover such people"
    )]
    FarFromModel {
        /// The greatest coefficient.
        deviation: f64,
        /// The limit.
        limit: f64,
    },
    /// The figure and the scan do not show the same person.
    #[error(
        "the figure does not match this scan: in the best pose, what should be visible of skin and inner clothes is {residual_mm:.0} mm from the scan on average, over the limit of {limit_mm:.0} mm"
    )]
    NotThisPerson {
        /// Mean distance in the best pose.
        residual_mm: f64,
        /// The limit.
        limit_mm: f64,
    },
    /// A limb is neither where the fit looked for it nor missing.
    #[error(
        "the {limb} was not found: the scan shows nothing of it where the fit puts it, {what}; its pose is too far from the previous step's, or from an A-pose"
    )]
    LimbNotFound {
        /// The limb.
        limb: String,
        /// What suggests that it is not missing.
        what: String,
    },
    /// The scan is far too small for the figure somewhere.
    #[error(
        "the figure does not fit into this scan: {percent:.1} % of the skin below the cloth is outside it, by up to {depth_mm:.0} mm at the {near}; {limit_mm:.0} mm are allowed"
    )]
    Outside {
        /// Share of the hidden skin.
        percent: f64,
        /// Depth outside, stray vertices not counted.
        depth_mm: f64,
        /// The limit.
        limit_mm: f64,
        /// Where.
        near: String,
    },
    /// A scan of a dressed person does not show what a body can be estimated from.
    #[error("no body can be estimated from this scan: {what}")]
    NotEstimated {
        /// What is wrong with it.
        what: String,
    },
    /// A linear system could not be factored.
    #[error("the registration's linear system could not be factored: {reason}")]
    Singular {
        /// What the solver reports.
        reason: String,
    },
    /// A fault of this program.
    #[error("internal error while {what}: {reason}")]
    Internal {
        /// What was being done.
        what: &'static str,
        /// What failed.
        reason: String,
    },
}

impl FitError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::EmptyScan => "scan again, or look at the file in a viewer".into(),
            Self::WrongLength { .. } | Self::OutOfRange { .. } | Self::Contradiction { .. } => {
                "correct the argument".into()
            }
            Self::NotABody { .. } => {
                "is the person clothed? Scan the bare body first; check the unit and the up axis (--unit, --up); one whole person must stand upright, in an A-pose"
                    .into()
            }
            Self::Unexplained { .. } => {
                "is the person clothed in the body's scan, do they sit or squat, is the up axis wrong (--up), or is a scan between missing? Scan one person alone, with empty hands, standing in an A-pose".into()
            }
            Self::NotEstimated { .. } => {
                "check --template; one whole person must stand upright, arms a little off the body and hands empty; or scan the bare body first"
                    .into()
            }
            Self::HalfABody { .. } => "scan the whole person; a hand, an arm or the head may be missing".into(),
            Self::FarFromModel { .. } => {
                "is the person clothed? Scan the bare body; check the unit (--unit); for a child start the session with a model of children (`overcoat new --body`)"
                    .into()
            }
            Self::NotThisPerson { .. } => {
                "check that this is the same person, and that no scan between was left out".into()
            }
            Self::LimbNotFound { .. } => {
                "scan again in an A-pose, hands away from the body; if the limb is really missing, `overcoat fit STEP --missing-limbs true` accepts that"
                    .into()
            }
            Self::Outside { .. } => {
                "check that this is the same person in nearly the pose of the previous step, and that no scan between was left out"
                    .into()
            }
            Self::Singular { .. } => {
                "the body model's mesh may be broken; leave --body out to use the embedded one".into()
            }
            Self::Internal { .. } => "this is a fault of Overcoat, not of your data; please report it".into(),
        })
    }
}

/// **Errors** [`FitError::WrongLength`] unless `given` is `expected`.
pub(crate) fn require_length(what: &'static str, given: usize, expected: usize) -> Result<(), FitError> {
    if given == expected { Ok(()) } else { Err(FitError::WrongLength { what, given, expected }) }
}

/// **Errors** [`FitError::OutOfRange`] unless `least ≤ given ≤ greatest`; NaN is out of range.
pub(crate) fn require_range(what: &'static str, given: f64, least: f64, greatest: f64) -> Result<(), FitError> {
    if (least..=greatest).contains(&given) {
        Ok(())
    } else {
        Err(FitError::OutOfRange { what, given, least, greatest })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_and_ranges_are_checked_and_nan_is_out_of_range() {
        assert!(require_length("a", 3, 3).is_ok());
        assert!(matches!(require_length("a", 2, 3), Err(FitError::WrongLength { given: 2, expected: 3, .. })));
        assert!(require_range("b", 1.0, 0.0, 1.0).is_ok());
        for bad in [-0.1, 1.1, f64::NAN] {
            assert!(matches!(require_range("b", bad, 0.0, 1.0), Err(FitError::OutOfRange { .. })), "{bad}");
        }
    }
}
