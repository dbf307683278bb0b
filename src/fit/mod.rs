//! Fitting: the naked scan (Hu 2017, Eq. 4), the surface registered to it, and the figure with all garments so far inside
//! the next scan (Eqs. 5–6).
//!
//! `solver` and `correspondence` serve `naked`, `inside` and `register`; `together` uses `naked` and `inside`.

#[cfg(test)]
mod argument_tests;
mod confidence;
mod correspondence;
mod error;
mod estimated;
mod hands;
mod inside;
mod landmarks;
mod naked;
mod register;
mod solver;
#[cfg(test)]
mod tests;
mod together;

pub use error::FitError;
pub use estimated::{
    Contact, DressedScan, EstimatedBody, HALF_INTERVAL_90, KnownMeasure, UncertainGirth, deviation_by_part,
    fit_estimated, places_inside, stand_off, visible_skin, zones,
};
pub use inside::{Cover, InsideMethod, InsideParams, InsideReport, PoseInside, fit_inside};
pub use landmarks::{Attached, AttachedFit, FitToPoints, Target, spread_in_motion};
pub use naked::{FittedBody, Hair, HairTreatment, NakedMethod, NakedParams, NakedReport, ShapeFrom, fit_naked};
pub use register::{
    FillInView, RegisterHints, RegisterParams, RegisteredBody, RegistrationReport, closest_weights, register,
    register_with_hints, scan_in_bind,
};
pub use solver::{FitIteration, JointGroup};
pub use together::{OtherScan, fit_together};
