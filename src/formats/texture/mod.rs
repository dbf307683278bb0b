//! Pictures of a mesh file, how its faces use them, and the files beside it that hold them.

mod raw_texture;
mod siblings;

pub use raw_texture::{EncodedPicture, RawMaterial, RawTexture, UnreadPart, Wrap};
pub use siblings::Siblings;
pub(super) use siblings::{Fetched, no_siblings};
