//! What a session runs: each kind of step as named calls of stages. `memo` runs them, `stages` has them.

mod body;
mod garment;
mod memo;
mod results;
mod stages;
mod steps;
mod tryon;

pub use memo::event::{Event, Forced, MovedFrame};
pub(in crate::session) use memo::input::FileInput;
pub use memo::reason::{Cause, Reason};
pub use memo::report::StageReport;
pub(in crate::session) use memo::report::verdict_on;
pub(in crate::session) use memo::walk::{Repaired, Walk};
pub(in crate::session) use results::{OfStep, StepResults};
pub use stages::animate::read_clip;
pub(in crate::session) use stages::animate::standing;
pub(in crate::session) use stages::garment_file::recognized;
pub(in crate::session) use stages::labelling::Labelling;
pub(in crate::session) use stages::marks::{MaskInput, MasksOfScan, is_something};
pub(in crate::session) use stages::pose::margin;
pub(in crate::session) use stages::posed::{along_normals, surfaces_inside};
pub(in crate::session) use stages::press::PosedGarments;
pub(in crate::session) use stages::scan::{Inputs as ScanInputs, cleaned_scan, photographs_of};
pub(in crate::session) use stages::step_scan::scan_of;
pub use steps::stages_of_animation;
pub(in crate::session) use steps::{SoFar, animations, cut_of, everything, steps, steps_so_far};
