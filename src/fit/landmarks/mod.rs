//! The pose of a figure from points that are attached to it: inverse kinematics by the solver of all fits.

mod attached;

pub use attached::{Attached, AttachedFit, FitToPoints, Target, spread_in_motion};
