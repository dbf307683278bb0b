//! Pictures of a session: contact sheets, the poster, the weights.

mod confidence;
mod draw_garment;
mod ease;
mod poster;
mod sheet;
mod tried_steps;
mod weights_sheet;

pub(in crate::session::results) use ease::draw_ease;
pub use ease::girth_notes;
#[cfg(feature = "rerun")]
pub(in crate::session) use sheet::SeenStep;
pub(in crate::session) use sheet::Turned;
pub use tried_steps::{ClipFrame, TriedSteps};
