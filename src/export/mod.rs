//! Arranges a figure as industry file formats; `formats` produces the bytes.

mod arguments;
mod attributes;
mod axes;
mod bones;
mod covered;
mod decimated;
mod encoded;
mod engines;
mod error;
mod format;
mod formats;
mod influences;
mod layers;
mod lint;
mod max_distance;
mod morphs;
mod palette;
mod pictures;
mod polygons;
mod quads;
mod remeshed;
mod spring_bones;
#[cfg(test)]
mod tests;
mod uncrossed;
mod visible_part;

pub use axes::FileAxes;
pub use bones::Bones;
pub use covered::{CoveredParts, RemovedPart};
pub use decimated::with_fewer_faces;
pub use encoded::{Check, Companion, Encoded};
pub use error::ExportError;
pub use format::{CharacterAnimation, CharacterOptions, Engine, Format, FormatOption, Rest};
pub use formats::{extensions, format_of, write_glb};
pub use layers::{write_joints_json, write_layer_ply, write_quads_ply, write_skin_weights_npy};
pub use quads::with_quads;
pub use remeshed::{Remeshed, RemeshedFigure, RemeshedLayer};
pub use spring_bones::{FittedSprings, SpringParams, fitted_springs};
