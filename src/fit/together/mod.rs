//! One body shape from all scans of a session: it fits the naked scan and the skin that the others show, and stays inside all
//! of them.
//!
//! Gauss–Newton over one β and one pose per scan, with the terms of the naked fit (Hu 2017, Eq. 4), and for each other scan
//! those of Eq. 5 over bare skin and of Eq. 6, one-sided, over covered skin. The poses are eliminated, so that a step solves
//! one small system per scan.

mod clothed_view;
mod fit_together;
mod other_scan;

pub use fit_together::fit_together;
pub use other_scan::OtherScan;
