//! Pictures of a session: contact sheets, the poster, the weights.

mod draw_garment;
mod poster;
mod sheet;
mod weights_sheet;

#[cfg(feature = "rerun")]
pub(in crate::session) use sheet::{SeenStep, Turned};
