//! The plausibility of a step's results, without ground truth: a garment that is not there, one that is missing, another
//! person, clothes in a bare scan, a scan that lies on its side.
//!
//! A stage answers the question that it is asked: the segmentation finds the part of the scan that is most like a hat,
//! also in a scan without one. Here the answer is compared with what the scan shows.

mod body;
mod cut_off;
mod doubts;
mod edge;
mod error;
mod garment;
mod holes;
mod layers;
mod limits;
mod lookalike;
mod posture;
mod size;
mod statistics;
#[cfg(test)]
mod tests;
mod tried_on;
mod unlisted;
mod verdict;

pub use body::{BodyPlausibility, BodyResult, check_body};
pub use doubts::Doubt;
pub use error::CheckError;
pub use garment::{GarmentPlausibility, GarmentResult, WornBefore, check_garment};
pub use limits::{Attained, Judged, judge};
pub use lookalike::{is_lookalike, lookalike_doubt};
pub use posture::Posture;
pub use size::SizeVerdict;
pub use tried_on::{TriedOn, doubts_of_laying_on, doubts_of_putting_on};
pub use unlisted::{Unlisted, find_unlisted};
pub use verdict::{HAIR_AREA, ON_HEAD_AREA, StageFindings, StepVerdict, Verdict, on_the_figure_before, verdict_on};
