//! A body that no scan shows bare: shape and poses from scans of the dressed person.
//!
//! Each kind of garment leaves a known gap to the skin, zone by zone; where it is small and nearly the same on all people
//! (shoulders, seat, waistband), the cloth says where the skin is. Visible skin is data, and the body stays inside.
//!
//! **Source** the objective is that of Zhang 2017 (BUFF: skin and cloth terms, outside penalty) with the gaps in the place of its
//! single cloth term; the covariance is Laplace's at the minimum.

mod acceptance;
mod contact;
mod deviation;
mod dressed_scan;
mod dressed_view;
mod fit_estimated;
mod known;
mod scalp;

pub use acceptance::{places_inside, visible_skin};
pub use contact::{Contact, stand_off, zones};
pub use deviation::{HALF_INTERVAL_90, deviation_by_part};
pub use dressed_scan::DressedScan;
pub use fit_estimated::{EstimatedBody, UncertainGirth, fit_estimated};
pub use known::KnownMeasure;
