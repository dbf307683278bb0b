//! Arranges a figure as industry file formats; `formats` produces the bytes.

mod arguments;
mod attributes;
mod bones;
mod covered;
mod engines;
mod error;
mod format;
mod glb;
mod influences;
mod layers;
mod list;
mod palette;
mod pictures;
mod quads;
mod reach;
mod split;
mod springs;
#[cfg(test)]
mod tests;
mod uncrossed;
mod usd;
mod visible_part;
mod vrm;

pub use bones::Bones;
pub use covered::{CoveredParts, RemovedPart};
pub use error::ExportError;
pub use format::{CharacterAnimation, CharacterOptions, Companion, Engine, Format, FormatOption, Rest};
pub use glb::write_glb;
pub use layers::{write_joints_json, write_layer_ply, write_quads_ply, write_skin_weights_npy};
pub use list::{extensions, format_of};
pub use quads::{QuadFigure, QuadLayer, Remeshed};
pub use springs::{FittedSprings, SwingParams, fitted_springs};
