//! Whole pages: contact sheets, the poster, rows of measures, steps of a method, a photo with what was found in it.

mod crossing_row;
mod ease_sheet;
mod photo_overlay;
mod poster;
mod sheet;
mod striding;
mod tryon_steps;
mod weights_row;

pub use crossing_row::CrossingRow;
pub use ease_sheet::{EaseRow, ease_color, ease_legend, ease_sheet};
pub use photo_overlay::{photo_dressed, photo_overlay};
pub use poster::{Poster, poster};
pub use sheet::{Cell, Sheet, SheetRow, contact_sheet};
pub use striding::striding;
pub use tryon_steps::tryon_steps;
pub use weights_row::{LayerPhysics, WeightedLayer, joint_legend};
