//! PLY: surfaces with colours and any further numbers per vertex.

mod header;
mod read;
mod rows;
#[cfg(test)]
mod tests;
mod write;

pub use read::read_ply;
pub use write::{PlyEncoding, PlyOptions, write_ply};
