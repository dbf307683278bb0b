//! The figure with all garments so far, posed inside the next scan: Hu 2017, Eqs. 5–6.

mod acceptance;
mod agreement;
mod constrained_step;
mod cover;
mod figure_surface;
mod fit_inside;
mod initial_pose;
mod offset;
mod paper;
mod params;
mod pose_inside;
mod problem;
mod refine;
mod report;
mod required_offset;
mod unseen_limbs;
mod violation;

pub use cover::Cover;
pub use fit_inside::fit_inside;
pub use params::{InsideMethod, InsideParams};
pub use pose_inside::PoseInside;
pub use report::InsideReport;

pub(crate) use figure_surface::FigureSurface;
pub(crate) use problem::InsideProblem;
