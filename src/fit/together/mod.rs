//! One body from all scans of a session: the shape that the naked scan and what shows of the skin in the others agree on,
//! with no scan that the body would have to leave.
//!
//! Gauss–Newton over one β and a pose a scan: the terms of the naked fit (Hu 2017, Eq. 4); of each other scan those of
//! Eq. 5 over bare skin, and Eq. 6 one-sided over covered skin. The poses are eliminated, so that a step costs as many
//! small systems as there are scans.

mod clothed_view;
mod fit_together;
mod other_scan;

pub use fit_together::fit_together;
pub use other_scan::OtherScan;
