//! Draws pictures of meshes without a screen or GPU: shaded views, contact sheets and posters; and sends recordings to
//! the Rerun viewer.

mod camera;
mod driven_film;
mod error;
mod film;
mod floor;
mod lettering;
mod lighting;
mod palette;
mod picture;
mod raster;
#[cfg(feature = "rerun")]
mod recording;
mod render;
mod scene;
mod sheets;
mod stick_figure;
mod style;
mod surface;

pub use camera::{Camera, Facing};
pub use driven_film::{BESIDE, driven_film, landmark_lines};
pub use error::Error;
pub use film::{FilmCamera, around, draw_gif, painted};
pub use palette::{joint_color, layer_color, ramp_color, skin_weight_colors};
pub use picture::Picture;
#[cfg(feature = "rerun")]
pub use recording::{Recording, Sink};
pub use render::render;
pub use scene::{Paint, Part, Scene};
pub use sheets::{
    Cell, CrossingRow, EaseRow, LayerPhysics, Poster, Sheet, SheetRow, WeightedLayer, contact_sheet, ease_color,
    ease_legend, ease_sheet, joint_legend, photo_dressed, photo_overlay, poster, striding, tryon_steps,
};
pub use stick_figure::stick_figure;
