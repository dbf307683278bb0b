//! Animations: whether they are up to date, and their frames as files and films.

mod animations;
mod film;
mod sequence;

pub use animations::AnimationStatus;
pub use film::Film;
pub use sequence::{SequenceKind, SequenceRequest};
