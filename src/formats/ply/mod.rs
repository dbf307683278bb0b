//! PLY: surfaces with colours and any further numbers per vertex.

mod colors;
mod faces;
mod header;
mod read;
mod rows;
#[cfg(test)]
mod tests;
mod write;

pub use read::read_ply;
pub(super) use read::{ply_siblings, read_ply_with};
pub use write::{PlyEncoding, PlyOptions, write_ply};
