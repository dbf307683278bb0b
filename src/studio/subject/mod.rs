//! Synthetic subjects: their surface, colours and stances.

mod appearance;
mod motion;
mod person;
mod stance;

pub use person::Subject;
pub use stance::ScanStance;
