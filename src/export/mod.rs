//! Arranges a figure as industry file formats; `formats` produces the bytes.

mod arguments;
mod bones;
mod covered;
mod error;
mod format;
mod glb;
mod layers;
mod list;
mod palette;
mod split;
#[cfg(test)]
mod tests;
mod visible_part;

pub use bones::Bones;
pub use covered::{CoveredParts, RemovedPart};
pub use error::ExportError;
pub use format::{CharacterAnimation, CharacterOptions, Format, FormatOption};
pub use glb::write_glb;
pub use layers::{write_joints_json, write_layer_ply, write_skin_weights_npy};
pub use list::{extensions, format_of};
