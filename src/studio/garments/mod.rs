//! Garments: sewing patterns by kind, cut and sewn around a dress form, put on and draped.

mod close_up;
mod collar;
mod dress_form;
mod dressing;
mod dye;
mod flare;
mod form;
mod hem;
mod kind;
mod pattern;
mod sewing;
mod size;
mod skin_weights;

pub use close_up::{ClothCloseUp, PreparedClothCloseUp};
pub use dressing::{DressedSubject, dress};
pub use form::{GarmentFile, GarmentForm};
pub use kind::GarmentKind;
pub use sewing::{SewnGarment, garment_file, sew};
pub use size::GarmentSize;
