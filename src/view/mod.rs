//! Draws pictures of meshes without a screen or GPU: shaded views, contact sheets and posters; and sends recordings to
//! the Rerun viewer.

mod camera;
mod crossing_row;
mod driven_film;
mod ease_sheet;
mod error;
mod film;
mod floor;
mod lettering;
mod lighting;
mod palette;
mod photo_overlay;
mod picture;
mod poster;
mod raster;
#[cfg(feature = "rerun")]
mod recording;
mod render;
mod scene;
mod sheet;
mod stick_figure;
mod striding;
mod style;
mod surface;
mod tryon_steps;
mod weights_row;

pub use camera::{Camera, Facing};
pub use crossing_row::CrossingRow;
pub use driven_film::{BESIDE, driven_film, landmark_lines};
pub use ease_sheet::{EaseRow, ease_sheet};
pub use error::Error;
pub use film::{FilmCamera, around, draw_gif, painted};
pub use palette::{joint_color, layer_color, ramp_color, skin_weight_colors};
pub use photo_overlay::photo_overlay;
pub use picture::Picture;
pub use poster::{Poster, poster};
#[cfg(feature = "rerun")]
pub use recording::{Recording, Sink};
pub use render::render;
pub use scene::{Paint, Part, Scene};
pub use sheet::{Cell, Sheet, SheetRow, contact_sheet};
pub use stick_figure::stick_figure;
pub use striding::striding;
pub use tryon_steps::tryon_steps;
pub use weights_row::{LayerPhysics, WeightedLayer, joint_legend};
