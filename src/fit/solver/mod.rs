//! The Gauss–Newton solver that all fits of bodies and figures share: the articulated surface and its Jacobian, the normal
//! equations, priors and joint limits, robust weights, the schedule and the loop.

mod articulated;
mod bone_sums;
mod iteration;
mod normal_equations;
mod posed;
mod prior;
mod robust_kernel;
mod schedule;

pub use iteration::FitIteration;
pub use prior::JointGroup;

pub(crate) use articulated::Articulated;
pub(crate) use iteration::{StoppingRule, iterate};
pub(crate) use normal_equations::{
    DAMPING, NormalEquations, PosePrior, Singular, Unknowns, shape_information, solve_together,
};
pub(crate) use posed::{Posed, Residual, parent_rotation};
pub(crate) use prior::{held_joints, limbs_only, pose_stiffness};
pub(crate) use robust_kernel::{mean_residual, robust};
pub(crate) use schedule::Phase;
