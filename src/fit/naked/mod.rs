//! The naked scan: Hu 2017, Eq. 4, by articulated ICP.

mod acceptance;
mod agreement;
mod bent_arms;
mod coarse_fit;
mod find_hair;
mod fit_naked;
mod fitted_body;
mod hair;
mod initial_poses;
mod paper;
mod params;
mod problem;
mod refine;
mod report;

pub use fit_naked::fit_naked;
pub use fitted_body::FittedBody;
pub use hair::Hair;
pub use params::{HairTreatment, NakedMethod, NakedParams, ShapeFrom};
pub use report::NakedReport;

pub(crate) use acceptance::conclude;
pub(crate) use agreement::agreement;
pub(crate) use coarse_fit::CoarseFit;
pub(crate) use problem::{FINEST, NakedProblem, STILL};
pub(crate) use refine::ModelEstimate;
