//! Why a fit gives no result.

/// Why a fit gives no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// There is nothing to fit to.
    #[error("the scan has no surface to fit a body to")]
    EmptyScan,
    /// No start explains the scan.
    #[error(
        "the scan does not look like a naked standing person: the best fit leaves {residual_mm:.0} mm on average, over {limit_mm:.0} mm"
    )]
    NotABody {
        /// Mean distance of the best fit.
        residual_mm: f64,
        /// The limit.
        limit_mm: f64,
    },
    /// The scan shows something else besides a body, or a body in a pose that was not found.
    #[error(
        "{percent:.0} % of the scan's surface is no part of the body that fits best, most of it at the {near}; {limit_percent:.0} % are allowed"
    )]
    Unexplained {
        /// Share of the scan's area.
        percent: f64,
        /// The limit.
        limit_percent: f64,
        /// The part of the body beside it.
        near: String,
    },
    /// A part without which nothing can be said of the rest.
    #[error("the scan shows {seen_percent:.0} % of a body, and nothing of its {region}")]
    HalfABody {
        /// What is missing.
        region: String,
        /// Share of the body's area that the scan shows.
        seen_percent: f64,
    },
    /// A child to a model of grown-ups.
    #[error(
        "the body that fits best lies {deviation:.1} standard deviations from the mean of the body model, over {limit:.1}: the model does not know such people"
    )]
    FarFromModel {
        /// The greatest coefficient.
        deviation: f64,
        /// The limit.
        limit: f64,
    },
    /// The figure and the scan do not belong together.
    #[error(
        "the figure dressed so far cannot be laid into this scan: the best pose leaves {residual_mm:.0} mm on average where skin or inner clothes should show, over {limit_mm:.0} mm"
    )]
    NotThisPerson {
        /// Mean distance of the best pose.
        residual_mm: f64,
        /// The limit.
        limit_mm: f64,
    },
    /// A limb is neither where it was looked for nor missing.
    #[error(
        "the {limb} was not found: nothing of it shows where the fit puts it, {what}; its pose is too far from the one before, or from an A-pose"
    )]
    LimbNotFound {
        /// The limb.
        limb: String,
        /// What speaks against its being missing.
        what: String,
    },
    /// The scan is far too small for the figure somewhere.
    #[error(
        "the figure dressed so far does not go into this scan: {percent:.1} % of the skin below the cloth stays outside it, by up to {depth_mm:.0} mm at the {near}; {limit_mm:.0} mm are allowed"
    )]
    Outside {
        /// Share of the hidden skin.
        percent: f64,
        /// How deep it lies outside, but for stray vertices.
        depth_mm: f64,
        /// The limit.
        limit_mm: f64,
        /// Where.
        near: String,
    },
    /// A linear system could not be solved.
    #[error("the registration's linear system could not be factored: {reason}")]
    Singular {
        /// What the solver says.
        reason: String,
    },
}

impl FitError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::EmptyScan => "scan again, or look at the file in a viewer".into(),
            Self::NotABody { .. } => {
                "check the unit and the up axis (--unit, --up); one whole person must stand upright, in an A-pose"
                    .into()
            }
            Self::Unexplained { .. } => {
                "scan one person alone, with empty hands, standing in an A-pose; or cut away what does not belong".into()
            }
            Self::HalfABody { .. } => "scan the whole person; a hand, an arm or the head may be missing".into(),
            Self::FarFromModel { .. } => {
                "check the unit (--unit); for a child start the session with a model of children (`overcoat new --body`)"
                    .into()
            }
            Self::NotThisPerson { .. } => {
                "check that this is the same person, and that no scan between was left out".into()
            }
            Self::LimbNotFound { .. } => {
                "scan again in an A-pose, hands away from the body; where the limb is really not there, `overcoat fit STEP --missing-limbs true` takes it for missing"
                    .into()
            }
            Self::Outside { .. } => {
                "check that this is the same person in nearly the pose of the step before, and that no scan between was left out"
                    .into()
            }
            Self::Singular { .. } => {
                "the body model's mesh may be broken; leave --body out to use the embedded one".into()
            }
        })
    }
}
