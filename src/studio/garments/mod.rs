//! Garments: sewing patterns by kind, cut and sewn around a dress form, put on and draped.

mod collar;
mod dress_form;
mod dressing;
mod dye;
mod flare;
mod hem;
mod kind;
mod pattern;
mod sewing;
mod skin_weights;

pub use dressing::{DressedSubject, dress};
pub use kind::GarmentKind;
pub use sewing::{SewnGarment, sew};
