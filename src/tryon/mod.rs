//! Try-on: puts an external garment onto a figure (Shi 2020).

mod dress;
mod error;
mod limbs;
mod placing;
mod recognize;
mod rims;
mod surface;

pub use dress::{TriedOn, TryOnParams, kind_of, try_on};
pub use error::TryOnError;
pub use limbs::Limb;
pub use placing::{Placed, place};
pub use recognize::{Openings, Recognized, recognize};
pub use rims::{Rim, rims_of};
pub use surface::GarmentSurface;
