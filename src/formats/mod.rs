//! Bytes to plain arrays and back. Knows no person and no garment, opens no path, and claims nothing about frame or
//! unit: that is for whoever reads.

mod error;
mod npz;
mod npz_io;
mod ply_header;
mod ply_read;
mod ply_rows;
mod ply_write;
mod raw_mesh;

#[cfg(test)]
mod ply_tests;

pub use error::{Format, FormatError};
pub use npz::{NpyArray, NpyData, Npz};
pub use npz_io::{NpzCompression, read_npy, read_npz, write_npy, write_npz};
pub use ply_read::read_ply;
pub use ply_write::{PlyEncoding, PlyOptions, write_ply};
pub use raw_mesh::{MeshKind, RawMesh, read_mesh};
